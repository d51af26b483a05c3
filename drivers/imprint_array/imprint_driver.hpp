#pragma once
// The state machine of one imprint array.

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "drivers/api/listening_driver.hpp"
#include "drivers/api/stream_watch.hpp"
#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"
#include "protocols/imprint/imprint.hpp"

namespace weft::drivers {

struct ImprintSettings {
  std::uint8_t rows = 0, cols = 0;  ///< of the part that is scanned
  /// Its first row and column; none: in the middle of the array that answers.
  std::optional<std::uint8_t> first_row, first_col;
  double rate_hz = 5;        ///< scans a second
  std::uint32_t serial = 0;  ///< that the array must have; 0: any
  Duration reply_timeout{};  ///< for the description, and then for the first scan
  Duration stale_after{};
  Duration watch{};  ///< windows in which scans, rate and clock are judged; zero: they are not
};

/// The part of an array of `rows` x `cols` taxels that the settings ask for.
/// Errors: device, where it does not lie inside.
Result<protocols::imprint::Window> window_on(const ImprintSettings& settings, std::uint8_t rows,
                                             std::uint8_t cols);

/// JSON Schema of the configuration.
extern const char imprint_config_schema[];

/// Errors: parse, invalid_argument, range; each at its JSON pointer.
Result<ImprintSettings> read_imprint_settings(std::string_view config_json);

/// Driver for a dense array of taxels that keeps an imprint. One page about it: README.md.
extern const DriverEntry imprint_array_entry;

/// Looks for frozen scans, another rate, a clock that runs wrong.
class ScanWatch final : public StreamWatch<protocols::imprint::Frame> {
 public:
  /// `window` zero: it does not look.
  ScanWatch(double rate_hz, Duration window);

 private:
  void begin(const protocols::imprint::Frame& scan) override;
  void note(const protocols::imprint::Frame& scan) override;
  [[nodiscard]] std::optional<Error> check_values(
      const protocols::imprint::Frame& scan) const override;

  std::array<std::uint8_t, protocols::imprint::max_taxels> first_{};  ///< of the window
  bool changed_ = false;
};

/// Asks for a part of the array and publishes each scan of it as a TaxelSample, row after row.
/// Nothing allocates while streaming.
class ImprintDriver final : public ListeningDriver {
 public:
  ImprintDriver(const ImprintSettings& settings, DriverHost& driver_host);

  /// Open when the array's description has come, is the configured one, and a scan of the part that
  /// was asked for has come.
  Status open() noexcept override;

 private:
  void received(ByteView bytes, TimePoint arrival) override;
  /// Armed when the next scan of the part that was asked for has come.
  void await_frames() override;
  void on_silence() override;

  void on_description();
  [[nodiscard]] std::optional<Error> unfit(
      const protocols::imprint::Description& description_seen) const;
  void on_scan(TimePoint arrival);
  void on_foreign_scan();
  void request_window();
  std::uint32_t count_lost();
  void publish(std::uint32_t lost, TimePoint arrival);
  void report_identity();

  ImprintSettings settings_;
  protocols::imprint::Splitter splitter_;
  protocols::imprint::SequenceTracker sequence_;
  protocols::imprint::Frame frame_;
  std::optional<protocols::imprint::Description> description_;
  protocols::imprint::Window window_;  ///< asked for, once the description is known
  std::uint16_t requests_ = 0;
  int foreign_scans_ = 0;  ///< in a row, of another part
  ScanWatch watch_;
  std::array<std::uint16_t, protocols::imprint::max_taxels> counts_{};
};

}  // namespace weft::drivers
