#pragma once
// Virtual time: ordered timers; when idle, jump to the next. Bit-for-bit repeatable.

#include <algorithm>
#include <cstdint>

#include "daemon/base/loop/timer_queue.hpp"

namespace weft::daemon {

/// A loop whose clock moves only from timer to timer. Same calls, same order, same result.
class VirtualLoop final : public Loop {
 public:
  [[nodiscard]] TimePoint now() const override { return now_; }
  TimerId at(TimePoint when, Callback callback) override {
    return timers_.add(std::max(when, now_), std::move(callback));
  }
  void cancel(TimerId id) override { timers_.cancel(id); }

  /// Runs the next timer, moving the clock to it. False when there is none.
  bool run_one();
  /// Runs until `done()` is true, looked at after each callback, or no timer is left.
  /// Returns done().
  bool run_until(const std::function<bool()>& done);
  /// Runs all timers up to and including `end`, then sets the clock to `end`.
  void run_to(TimePoint end);

  /// Timers run so far: a measure of work that no machine changes.
  [[nodiscard]] std::uint64_t events() const { return events_; }

 private:
  TimePoint now_{};
  std::uint64_t events_ = 0;
  TimerQueue timers_;
};

}  // namespace weft::daemon
