#pragma once
// Looks at the stream of a force/torque sensor for what no single record shows: values that stand
// still, and another rate than configured.

#include <array>
#include <optional>
#include <string_view>

#include "drivers/api/stream_watch.hpp"
#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"

namespace weft::drivers {

struct WrenchWatchSettings {
  double rate_hz = 100;    ///< records a second that are looked at, lost ones included
  Duration stuck_after{};  ///< zero: values that stand still are no fault
  std::string_view rate_hint;
};

/// Pure. Allocates only for the error.
class WrenchWatch {
 public:
  explicit WrenchWatch(const WrenchWatchSettings& settings) : settings_(settings) {}

  void restart();
  /// `counts`: of the six components or gauges. `lost`: records missing before this one.
  /// Errors: device.
  std::optional<Error> check(const std::array<double, 6>& counts, std::uint32_t lost,
                             TimePoint arrival);

 private:
  std::optional<Error> check_stuck(const std::array<double, 6>& counts, TimePoint arrival);
  std::optional<Error> check_rate(std::uint32_t lost, TimePoint arrival);

  WrenchWatchSettings settings_;
  std::optional<std::array<double, 6>> last_;
  TimePoint changed_at_{};
  std::uint32_t same_ = 0;  ///< records since the values changed
  std::optional<TimePoint> window_from_;
  double in_window_ = 0;
  Suspicion rate_;
};

}  // namespace weft::drivers
