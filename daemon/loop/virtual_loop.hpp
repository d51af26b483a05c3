#pragma once
// Virtual time: ordered timers; when idle, jump to the next. Bit-for-bit repeatable.

#include <cstddef>
#include <unordered_map>
#include <vector>

#include "drivers/api/loop.hpp"

namespace weft::daemon {

/// A loop whose clock moves only from timer to timer. Same calls, same order, same result.
class VirtualLoop final : public Loop {
 public:
  [[nodiscard]] TimePoint now() const override { return now_; }
  TimerId at(TimePoint when, Callback callback) override;
  void cancel(TimerId id) override { callbacks_.erase(id); }

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
  struct Due {
    TimePoint when;
    TimerId id;
    bool operator>(const Due& o) const { return when != o.when ? when > o.when : id > o.id; }
  };
  bool next_due(TimePoint& when);

  TimePoint now_{};
  TimerId last_id_ = 0;
  std::uint64_t events_ = 0;
  std::vector<Due> queue_;  ///< a heap; cancelled entries stay until they surface
  std::unordered_map<TimerId, Callback> callbacks_;
};

}  // namespace weft::daemon
