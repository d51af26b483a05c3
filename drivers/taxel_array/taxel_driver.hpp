#pragma once
// The state machine of one tactile array.

#include <array>
#include <cstdint>
#include <string_view>

#include "drivers/api/listening_driver.hpp"
#include "drivers/api/stream_watch.hpp"
#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"
#include "protocols/taxel/taxel.hpp"

namespace weft::drivers {

enum class TaxelForm : std::uint8_t {
  weft,     ///< Weft's own framing over a serial stream (protocols/taxel/README.md)
  cpm_udp,  ///< datagrams of the CPM-Finger's gateway
};

struct TaxelSettings {
  std::uint8_t taxels = 16;
  TaxelForm form = TaxelForm::weft;
  Duration reply_timeout{};  ///< for the first frame
  Duration stale_after{};
  double rate_hz = 37;
  Duration watch{};  ///< length of the windows that check taxels, rate and clock; zero: no checks
  bool has_noise = true;  ///< false: constant taxels are no fault
};

/// JSON Schema of the configuration.
extern const char taxel_config_schema[];

/// Errors: parse, invalid_argument, range; each at its JSON pointer.
Result<TaxelSettings> read_taxel_settings(std::string_view config_json);

/// Driver for the tactile array, in either of its framings; see README.md.
extern const DriverEntry taxel_array_entry;

/// Detects dead, saturated and noisy taxels. Errors: device_data, with the taxel.
class FrameWatch final : public StreamWatch<protocols::taxel::Frame> {
 public:
  explicit FrameWatch(const TaxelSettings& settings);

 private:
  using Frame = protocols::taxel::Frame;
  struct Changes {
    std::uint32_t steps = 0;  ///< frames in which the taxel changed
    double path = 0;          ///< sum of the changes' sizes [counts]
    double largest = 0;       ///< largest change; a single step is no noise
  };

  void begin(const Frame& frame) override;
  void note(const Frame& frame) override;
  [[nodiscard]] std::optional<Error> check_values(const Frame& frame) const override;
  [[nodiscard]] std::optional<Error> check_still(const Frame& frame) const;
  [[nodiscard]] std::optional<Error> check_noise(const Frame& frame) const;

  std::array<std::uint16_t, protocols::taxel::max_taxels> last_{};
  bool has_noise_;
  std::array<Changes, protocols::taxel::max_taxels> changes_{};
};

/// Publishes each frame as a TaxelSample. The sensor sends without a request, so this driver only
/// receives. Does not allocate while streaming.
class TaxelDriver final : public ListeningDriver {
 public:
  TaxelDriver(const TaxelSettings& settings, DriverHost& driver_host);

  /// Becomes open with the first good frame.
  Status open() noexcept override;

 private:
  void received(ByteView bytes, TimePoint arrival) override;
  /// Becomes armed with the next good frame.
  void await_frames() override;
  void on_silence() override;

  /// Return the number of damaged frames or datagrams.
  std::uint64_t on_stream(ByteView bytes, TimePoint arrival);
  std::uint64_t on_datagram(ByteView datagram, TimePoint arrival);
  void on_frame(TimePoint arrival);
  std::optional<std::uint32_t> count_lost();
  bool came_late();
  void publish(std::uint32_t lost, TimePoint arrival);

  TaxelSettings settings_;
  protocols::taxel::Splitter splitter_;
  protocols::taxel::SequenceTracker sequence_;
  protocols::taxel::Frame frame_;
  FrameWatch watch_;
  std::uint32_t last_device_us_ = 0;
  std::uint64_t late_ = 0;  ///< duplicate or late frames
  std::uint16_t last_late_ = 0;
  int late_in_a_row_ = 0;  ///< late frames in a row with consecutive numbers
};

}  // namespace weft::drivers
