#pragma once
// The state machine of one imprint array.

#include <array>
#include <optional>

#include "drivers/api/driver_base.hpp"
#include "drivers/api/timer.hpp"
#include "drivers/imprint_array/scan_watch.hpp"
#include "drivers/imprint_array/settings.hpp"
#include "protocols/imprint/imprint.hpp"

namespace weft::drivers {

/// Asks for a part of the array and publishes each scan of it as a TaxelSample, row after row.
/// Nothing allocates while streaming.
class ImprintDriver final : public DriverBase {
 public:
  ImprintDriver(const ImprintSettings& settings, DriverHost& driver_host);

  /// Open when the array's description has come, is the configured one, and a scan of the part that
  /// was asked for has come.
  Status open() noexcept override;
  /// Armed when the next such scan has come.
  Status arm() noexcept override;
  /// Errors: wrong_state, unsupported: there is nothing to command.
  Result<std::uint32_t> command(const Command& command) noexcept override;
  /// Ends publishing: armed -> open.
  void stop() noexcept override;
  void close() noexcept override;

 private:
  void received(ByteView bytes, TimePoint arrival) override;
  void make_safe() noexcept override;

  void on_description();
  [[nodiscard]] std::optional<Error> unfit(const protocols::imprint::Description& told) const;
  void on_scan(TimePoint arrival);
  void on_foreign_scan();
  void ask_for_window();
  std::uint32_t count_lost();
  bool advance();
  void publish(std::uint32_t lost, TimePoint arrival);
  void tell_identity();
  void report_damage(TimePoint arrival);
  void on_silence();
  void rest();

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
  bool arming_ = false;

  std::uint64_t damaged_ = 0;  ///< frames that could not be used
  std::uint64_t damaged_reported_ = 0;
  TimePoint damage_reported_at_{};

  Watchdog silence_;
};

}  // namespace weft::drivers
