#pragma once
// Looks at a stream of records for what no single record shows: values that stand still, and
// another rate than the box is set to.

#include <optional>

#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"
#include "protocols/rdt/rdt.hpp"

namespace weft::drivers {

/// Pure. Allocates only for the error.
class StreamWatch {
 public:
  StreamWatch(double rate_hz, Duration stuck_after)
      : rate_hz_(rate_hz), stuck_after_(stuck_after) {}

  void restart();
  /// `lost`: records missing before this one. Errors: device.
  std::optional<Error> look(const protocols::rdt::Record& record, std::uint32_t lost,
                            TimePoint arrival);

 private:
  std::optional<Error> look_for_stuck(const protocols::rdt::Record& record, TimePoint arrival);
  std::optional<Error> look_at_rate(std::uint32_t lost, TimePoint arrival);

  double rate_hz_;
  Duration stuck_after_;
  std::optional<protocols::rdt::Record> last_;
  TimePoint changed_at_{};
  std::uint32_t same_ = 0;  ///< records since the values changed
  std::optional<TimePoint> window_from_;
  double in_window_ = 0;
  int wrong_windows_ = 0;
};

}  // namespace weft::drivers
