#pragma once
// UTC that never goes back: the wall clock of a machine may be set back, by a person or by NTP,
// while runs, tokens and a journal go by it.

#include <algorithm>
#include <chrono>

namespace weft::daemon {

/// Time is an argument. It goes on at least as fast as the monotonic clock from where it was last:
/// after a step back of the wall clock it runs ahead of that until the daemon starts anew; a step
/// forward is followed. So what expires at a time is never good again, and later is never before.
class MonotonicUtcClock {
 public:
  using Time = std::chrono::nanoseconds;

  /// `wall`: since 1970-01-01 UTC; `steady`: monotonic, any origin.
  Time now(Time wall, Time steady) {
    if (begun_) wall = std::max(wall, utc_ + std::max(Time(0), steady - steady_));
    begun_ = true;
    utc_ = wall;
    steady_ = std::max(steady_, steady);
    return utc_;
  }

 private:
  bool begun_ = false;
  Time utc_{}, steady_ = Time::min();
};

}  // namespace weft::daemon
