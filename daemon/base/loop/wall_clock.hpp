#pragma once
// The computer's clocks: UTC, UTC that never goes back, monotonic and processor time. For dates,
// expiry, speed measurements and the recorder's commit budget; never for control.

#include <algorithm>
#include <chrono>
#include <ctime>

namespace weft::daemon {

/// UTC that never goes back. A person or NTP may set the wall clock back while runs, tokens and a
/// journal depend on it. Time is an argument. It advances at least as fast as the monotonic clock
/// since its last value. After a step back of the wall clock it is ahead of that clock until the
/// daemon restarts; it follows a step forward. So an expired item stays expired, and later events
/// have later times.
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

/// Monotonic, any origin.
inline std::chrono::nanoseconds steady_wall_now() {
  return std::chrono::steady_clock::now().time_since_epoch();
}

/// The same in seconds.
inline double steady_wall_seconds() {
  return std::chrono::duration<double>(steady_wall_now()).count();
}

/// Processor time of this process only, any origin: other work of the computer does not count.
inline double process_cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Processor time of this thread only, any origin.
inline double thread_cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Since 1970-01-01 UTC; recorded for people, part of no digest.
inline std::chrono::nanoseconds utc_now() {
  return std::chrono::system_clock::now().time_since_epoch();
}

}  // namespace weft::daemon
