#pragma once
// What a watch of a sensor's pace believes, and when.

#include <optional>
#include <string>

#include "protocols/base/result.hpp"

namespace weft::drivers {

/// A figure that is wrong in one window may be a machine that was busy and catches up; in two in a
/// row it is believed.
class Suspicion {
 public:
  /// True when `seen` is more than a quarter off `expected` (> 0), as it was in the window before.
  bool confirmed(double seen, double expected) {
    constexpr double tolerance = 0.25;
    constexpr int windows_to_believe = 2;
    const bool right = seen > expected * (1 - tolerance) && seen < expected * (1 + tolerance);
    windows_ = right ? 0 : windows_ + 1;
    return windows_ >= windows_to_believe;
  }
  void drop() { windows_ = 0; }

 private:
  int windows_ = 0;  ///< in a row
};

/// The sensor's own clock over a window of `seconds` on the host's. Errors: device.
inline std::optional<Error> check_clock(Suspicion& wrong, double device_s, double seconds) {
  if (!wrong.confirmed(device_s, seconds)) return std::nullopt;
  return Error{.code = Errc::device_data,
               .what = "the sensor's clock runs wrong",
               .expected = std::to_string(seconds) + " s",
               .got = std::to_string(device_s) + " s by the sensor's clock",
               .hint = "Look at the microcontroller's clock source"};
}

}  // namespace weft::drivers
