#pragma once
// Watches the stream of a force/torque sensor for problems that no single record shows: constant
// values and a wrong rate.

#include <array>
#include <optional>
#include <string_view>

#include "drivers/api/stream_watch.hpp"
#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"

namespace weft::drivers {

struct WrenchWatchSettings {
  double rate_hz = 100;    ///< checked records per second, lost ones included
  Duration stuck_after{};  ///< zero: constant values are no fault
  std::string_view rate_hint;
};

/// Pure. Allocates only for the error.
class WrenchWatch {
 public:
  explicit WrenchWatch(const WrenchWatchSettings& settings) : settings_(settings) {}

  void restart();
  /// `counts`: the six components or gauges. `lost`: records missing before this one. Errors:
  /// device_data or device_settings.
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
