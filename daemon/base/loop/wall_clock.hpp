#pragma once
// The machine's clocks: UTC, UTC that never goes back, monotonic and processor time. For dates,
// expiry, figures of speed and the recorder's commit budget; never for control.

#include <algorithm>
#include <chrono>
#include <ctime>

namespace weft::daemon {

/// UTC that never goes back: the wall clock of a machine may be set back, by a person or by NTP,
/// while runs, tokens and a journal go by it. Time is an argument. It goes on at least as fast as
/// the monotonic clock from where it was last: after a step back of the wall clock it runs ahead of
/// that until the daemon starts anew; a step forward is followed. So what expires at a time is
/// never good again, and later is never before.
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

/// Processor time of this process alone, any origin: other work of the machine does not count.
inline double process_cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Processor time of this thread alone, any origin.
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
