#pragma once
// The state machine of one vibration sensor.

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "drivers/api/listening_driver.hpp"
#include "drivers/api/stream_watch.hpp"
#include "drivers/api/timer.hpp"
#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"
#include "protocols/vibro/vibro.hpp"

namespace weft::drivers {

struct VibroSettings {
  double acceleration_rate_hz = 200;  ///< readings per second; 0: channel not used
  double sound_rate_hz = 8000;
  std::uint32_t serial = 0;  ///< required serial number; 0: any
  Duration reply_timeout{};  ///< for the description, which the sensor sends once a second
  Duration stale_after{};
  Duration watch{};  ///< length of the windows that check values, rate and clock; zero: no checks
};

/// JSON Schema of the configuration.
extern const char vibro_config_schema[];

/// Errors: parse, invalid_argument, range; each at its JSON pointer.
Result<VibroSettings> read_vibro_settings(std::string_view config_json);

/// Driver for a vibration sensor (accelerometer and microphone); see README.md.
extern const DriverEntry vibro_entry;

/// Detects frozen or saturated values, a wrong rate and a wrong clock. Errors: device_data, with
/// the axis.
class BlockWatch final : public StreamWatch<protocols::vibro::Frame> {
 public:
  /// `window` zero: no checks. `blocks_hz`: blocks per second. `full_scale_counts`: the largest
  /// count of the channel.
  BlockWatch(Duration window, double blocks_hz, int full_scale_counts);

 private:
  void begin(const protocols::vibro::Frame& block) override;
  void note(const protocols::vibro::Frame& block) override;
  [[nodiscard]] std::optional<Error> check_values(
      const protocols::vibro::Frame& block) const override;

  int full_scale_counts_;
  std::array<std::int16_t, protocols::vibro::axes> first_values_{};
  std::array<bool, protocols::vibro::axes> changed_{};
};

/// Classifies blocks as new or late, counts missing blocks and detects a restart of the sensor.
class BlockOrder {
 public:
  enum class Verdict : std::uint8_t { next, late, restarted };
  struct Step {
    Verdict verdict = Verdict::next;
    std::uint32_t lost = 0;  ///< blocks missing right before this one
  };

  void reset() { *this = {}; }

  /// An older block is a duplicate or late. Exceptions show a restarted sensor: a clock that is far
  /// behind, or a run of such blocks. The run may be short if the clock advances, which it does not
  /// for late datagrams.
  Step observe(const protocols::vibro::Frame& block) {
    const std::int32_t back_us = seen_ ? static_cast<std::int32_t>(last_us_ - block.device_us) : 0;
    const bool far_back = back_us > latest_us;
    const int restart_after = back_us < 0 ? run_while_clock_runs : run_with_clock_back;
    const SequenceStep step = sequence_.observe(block.sequence);
    const bool older =
        step.event == SequenceEvent::out_of_order || step.event == SequenceEvent::duplicate;
    if (older && !far_back && ++late_in_a_row(block) < restart_after) return {Verdict::late, 0};
    late_run_ = 0;
    seen_ = true;
    last_us_ = block.device_us;
    if (!older && !far_back) return {Verdict::next, step.lost};
    sequence_.reset();
    sequence_.observe(block.sequence);
    return {Verdict::restarted, 0};
  }

 private:
  static constexpr std::int32_t latest_us = 2'000'000;
  static constexpr int run_while_clock_runs = 3;
  static constexpr int run_with_clock_back = 10;

  /// Number of late blocks directly before, with consecutive numbers.
  int& late_in_a_row(const protocols::vibro::Frame& block) {
    if (block.sequence != static_cast<std::uint16_t>(last_late_ + 1)) late_run_ = 0;
    last_late_ = block.sequence;
    return late_run_;
  }

  protocols::vibro::SequenceTracker sequence_;
  bool seen_ = false;
  std::uint32_t last_us_ = 0;
  std::uint16_t last_late_ = 0;
  int late_run_ = 0;
};

/// Publishes each block as an AccelerationSample or a SoundSample in SI. The sensor sends without a
/// request, so this driver only receives. Does not allocate while streaming.
class VibroDriver final : public ListeningDriver {
 public:
  VibroDriver(const VibroSettings& settings, DriverHost& driver_host);

  /// Becomes open once the description has arrived and matches the configuration.
  Status open() noexcept override;

 private:
  /// One configured channel.
  struct Channel {
    Channel(VibroDriver& driver, protocols::vibro::Kind its_kind, double configured_hz);
    [[nodiscard]] bool wanted() const { return rate_hz > 0; }

    protocols::vibro::Kind kind;
    double rate_hz;                                  ///< as configured; 0: channel not used
    protocols::vibro::ChannelDescription described;  ///< by the sensor
    double unit_per_count = 0;                       ///< [m/s2] or [Pa]
    int largest_count = 0;                           ///< largest magnitude within the range
    BlockOrder order;
    BlockWatch watch{{}, 1, 1};
    Watchdog silence;
    bool came = false;  ///< a block has arrived since arming began
    bool late_reported = false;
  };

  void received(ByteView bytes, TimePoint arrival) override;
  /// Becomes armed once a block of every configured channel has arrived.
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
