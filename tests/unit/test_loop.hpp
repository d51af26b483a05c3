#pragma once
// A clock for tests.

#include <algorithm>
#include <map>
#include <utility>

#include "drivers/api/timer.hpp"

namespace weft::testing {

/// A time that the test advances from timer to timer.
class TestLoop final : public Loop {
 public:
  [[nodiscard]] TimePoint now() const override { return now_; }
  TimerId at(TimePoint when, Callback callback) override {
    timers_.emplace(std::pair(std::max(when, now_), ++last_), std::move(callback));
    return last_;
  }
  void cancel(TimerId id) override {
    std::erase_if(timers_, [id](const auto& timer) { return timer.first.second == id; });
  }
  /// Runs all timers due up to `end`, and leaves the clock there.
  void run_to(TimePoint end) {
    while (!timers_.empty() && timers_.begin()->first.first <= end) {
      auto timer = timers_.extract(timers_.begin());
      now_ = timer.key().first;
      timer.mapped()();
    }
    now_ = end;
  }
  void run_for(double seconds) { run_to(now_ + from_seconds(seconds)); }
  [[nodiscard]] std::size_t timers() const { return timers_.size(); }

 private:
  TimePoint now_{};
  TimerId last_ = 0;
  std::map<std::pair<TimePoint, TimerId>, Callback> timers_;
};

}  // namespace weft::testing
