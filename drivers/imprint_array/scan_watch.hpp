#pragma once
// Looks at the scans of an imprint array for what no single scan shows: that they are frozen,
// another rate, a clock that runs wrong.

#include <array>
#include <optional>

#include "drivers/api/suspicion.hpp"
#include "protocols/base/time.hpp"
#include "protocols/imprint/imprint.hpp"

namespace weft::drivers {

/// Pure. Judges one window of time after another; allocates only for the error.
class ScanWatch {
 public:
  /// `window` zero: it does not look.
  ScanWatch(double rate_hz, Duration window) : rate_hz_(rate_hz), window_(window) {}

  void restart() { from_.reset(); }
  /// `lost`: scans missing before this one. Errors: device.
  std::optional<Error> check(const protocols::imprint::Frame& scan, std::uint32_t lost,
                             TimePoint arrival);

 private:
  void begin(const protocols::imprint::Frame& scan, TimePoint arrival);
  [[nodiscard]] std::optional<Error> evaluate(const protocols::imprint::Frame& scan,
                                              double seconds);

  double rate_hz_;
  Duration window_;
  std::optional<TimePoint> from_;
  std::uint32_t first_us_ = 0;
  std::array<std::uint8_t, protocols::imprint::max_taxels> first_{};  ///< of the window
  bool changed_ = false;
  std::uint32_t scans_ = 0;
  double expected_scans_ = 0;  ///< lost ones included
  Suspicion rate_, clock_;
};

}  // namespace weft::drivers
