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
  std::uint8_t rows = 0, cols = 0;  ///< size of the scanned part
  /// Its first row and column; nullopt: the centre of the array that answers.
  std::optional<std::uint8_t> first_row, first_col;
  double rate_hz = 5;        ///< scans per second
  std::uint32_t serial = 0;  ///< required serial number; 0: any
  Duration reply_timeout{};  ///< for the description, and then for the first scan
  Duration stale_after{};
  Duration watch{};  ///< length of the windows that check scans, rate and clock; zero: no checks
};

/// The configured part of an array of `rows` x `cols` taxels. Errors: device_settings, if it
/// exceeds the array.
Result<protocols::imprint::Window> window_on(const ImprintSettings& settings, std::uint8_t rows,
                                             std::uint8_t cols);

/// JSON Schema of the configuration.
extern const char imprint_config_schema[];

/// Errors: parse, invalid_argument, range; each at its JSON pointer.
Result<ImprintSettings> read_imprint_settings(std::string_view config_json);

/// Driver for a dense imprint array; see README.md.
extern const DriverEntry imprint_array_entry;

/// Detects frozen scans, a wrong rate and a wrong clock.
class ScanWatch final : public StreamWatch<protocols::imprint::Frame> {
 public:
  /// `window` zero: no checks.
  ScanWatch(double rate_hz, Duration window);

 private:
  void begin(const protocols::imprint::Frame& scan) override;
  void note(const protocols::imprint::Frame& scan) override;
  [[nodiscard]] std::optional<Error> check_values(
      const protocols::imprint::Frame& scan) const override;

  std::array<std::uint8_t, protocols::imprint::max_taxels> first_{};  ///< first scan of the window
  bool changed_ = false;
};

/// Requests a part of the array and publishes each scan of it as a TaxelSample, row by row. Does
/// not allocate while streaming.
class ImprintDriver final : public ListeningDriver {
 public:
  ImprintDriver(const ImprintSettings& settings, DriverHost& driver_host);

  /// Becomes open once the description matches the configuration and a scan of the requested part
  /// has arrived.
  Status open() noexcept override;

 private:
  void received(ByteView bytes, TimePoint arrival) override;
  /// Becomes armed with the next scan of the requested part.
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
  protocols::imprint::Window window_;  ///< the requested part; valid once the description is known
  std::uint16_t requests_ = 0;
  int foreign_scans_ = 0;  ///< scans in a row of another part
  ScanWatch watch_;
  std::array<std::uint16_t, protocols::imprint::max_taxels> counts_{};
};

}  // namespace weft::drivers
