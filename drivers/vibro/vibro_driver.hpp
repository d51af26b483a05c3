#pragma once
// The state machine of one vibration sensor.

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "drivers/api/listening_driver.hpp"
#include "drivers/api/timer.hpp"
#include "drivers/vibro/block_watch.hpp"
#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"
#include "protocols/vibro/vibro.hpp"

namespace weft::drivers {

struct VibroSettings {
  double acceleration_rate_hz = 200;  ///< readings a second; 0: the channel is not looked at
  double sound_rate_hz = 8000;
  std::uint32_t serial = 0;  ///< that the sensor must have; 0: any
  Duration reply_timeout{};  ///< for the sensor's description, which comes once a second
  Duration stale_after{};
  Duration watch{};  ///< windows in which values, rate and clock are judged; zero: they are not
};

/// JSON Schema of the configuration.
extern const char vibro_config_schema[];

/// Errors: parse, invalid_argument, range; each at its JSON pointer.
Result<VibroSettings> read_vibro_settings(std::string_view config_json);

/// Driver for a vibration sensor: accelerometer and microphone. One page about it: README.md.
extern const DriverEntry vibro_entry;

/// Publishes each block as an AccelerationSample or a SoundSample in SI. The sensor sends without
/// being asked, so this driver only listens. Nothing allocates while streaming.
class VibroDriver final : public ListeningDriver {
 public:
  VibroDriver(const VibroSettings& settings, DriverHost& driver_host);

  /// Open when the sensor's description has come and is the configured one.
  Status open() noexcept override;

 private:
  /// One configured channel.
  struct Channel {
    Channel(VibroDriver& driver, protocols::vibro::Kind its_kind, double configured_hz);
    [[nodiscard]] bool wanted() const { return rate_hz > 0; }

    protocols::vibro::Kind kind;
    double rate_hz;                                  ///< as configured; 0: not looked at
    protocols::vibro::ChannelDescription described;  ///< by the sensor
    double unit_per_count = 0;                       ///< [m/s2] or [Pa]
    int largest_count = 0;                           ///< its size at either end of the range
    BlockOrder order;
    BlockWatch watch{{}, 1, 1};
    Watchdog silence;
    bool came = false;  ///< a block since arming began
    bool late_reported = false;
  };

  void received(ByteView bytes, TimePoint arrival) override;
  /// Armed when a block of every configured channel has come.
  void await_frames() override;
  void on_silence() override;
  void stop_waiting() noexcept override;

  void on_frame(TimePoint arrival);
  void on_description();
  [[nodiscard]] std::optional<Error> unfit(
      const Channel& channel, const protocols::vibro::ChannelDescription& description_seen) const;
  void learn(Channel& channel, const protocols::vibro::ChannelDescription& description_seen);
  void report_identity();
  void on_block(Channel& channel, TimePoint arrival);
  bool advance(Channel& channel);
  void publish(const Channel& channel, std::uint32_t lost, TimePoint arrival);
  void on_channel_silence(const Channel& channel);

  VibroSettings settings_;
  protocols::vibro::Splitter splitter_;
  protocols::vibro::Frame frame_;
  std::optional<protocols::vibro::Description> description_;
  Channel acceleration_, sound_;
  std::array<double, protocols::vibro::max_values> values_{};  ///< of the block in SI
};

}  // namespace weft::drivers
