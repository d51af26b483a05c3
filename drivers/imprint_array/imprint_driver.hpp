#pragma once
// The state machine of one imprint array.

#include <array>
#include <optional>

#include "drivers/api/listening_driver.hpp"
#include "drivers/api/timer.hpp"
#include "drivers/imprint_array/scan_watch.hpp"
#include "drivers/imprint_array/settings.hpp"
#include "protocols/imprint/imprint.hpp"

namespace weft::drivers {

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
  void stop_waiting() noexcept override;
  void forget_bytes() noexcept override;

  void on_description();
  [[nodiscard]] std::optional<Error> unfit(
      const protocols::imprint::Description& description_seen) const;
  void on_scan(TimePoint arrival);
  void on_foreign_scan();
  void request_window();
  std::uint32_t count_lost();
  bool advance();
  void publish(std::uint32_t lost, TimePoint arrival);
  void report_identity();
  void on_silence();

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

  Watchdog silence_;
};

}  // namespace weft::drivers
