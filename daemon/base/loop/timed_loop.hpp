#pragma once
// Measures the wall time of a virtual run: a view of a loop that times the callbacks set through
// it.

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "drivers/api/timer.hpp"

namespace weft::daemon {

/// Callbacks by due time; those of one instant leave in their order of arrival. Callbacks are
/// stored in reused slots, so that a long run neither hashes nor allocates per timer.
class TimerQueue {
 public:
  TimerId add(TimePoint when, Loop::Callback&& callback);
  /// Ignores an id that was already taken or never existed.
  void cancel(TimerId id) {
    if (is_waiting(id)) release(id);
  }

  /// Due time of the next callback; nothing if there is none.
  [[nodiscard]] std::optional<TimePoint> next_due();
  /// Takes the next callback out. Requires one, found by next_due() just before.
  Loop::Callback pop_next();

 private:
  /// An id is a running number followed by the slot: ids ascend, and no two timers share one.
  static constexpr unsigned slot_bits = 24;
  struct Due {
    TimePoint when;
    TimerId id;
    bool operator>(const Due& o) const { return when != o.when ? when > o.when : id > o.id; }
  };
  struct Slot {
    TimerId id = 0;  ///< 0: free
    Loop::Callback callback;
  };

  static std::size_t slot_of(TimerId id) { return id & ((TimerId{1} << slot_bits) - 1); }
  [[nodiscard]] bool is_waiting(TimerId id) const {
    return id != 0 && slot_of(id) < slots_.size() && slots_[slot_of(id)].id == id;
  }
  Loop::Callback release(TimerId id);

  TimerId last_number_ = 0;
  std::vector<Due> heap_;  ///< cancelled entries stay until they reach the top
  std::vector<Slot> slots_;
  std::vector<std::size_t> free_;
};

/// Times one callback in `stride` and scales the result: an estimate, so that measuring costs far
/// less than the measured work.
class TimedLoop final : public Loop {
 public:
  explicit TimedLoop(Loop& inner) : inner_(&inner) {}
  [[nodiscard]] TimePoint now() const override { return inner_->now(); }
  TimerId at(TimePoint when, Callback callback) override;
  void cancel(TimerId id) override { inner_->cancel(id); }

  /// Estimated time in callbacks so far [s].
  [[nodiscard]] double seconds() const { return std::chrono::duration<double>(spent_).count(); }

 private:
  static constexpr unsigned stride = 64;
  Loop* inner_;
  unsigned count_ = 0;
  std::chrono::nanoseconds spent_{};
};

/// A loop with a clock that moves only from timer to timer. Same calls, same order, same result.
class VirtualLoop final : public Loop {
 public:
  [[nodiscard]] TimePoint now() const override { return now_; }
  TimerId at(TimePoint when, Callback callback) override {
    return timers_.add(std::max(when, now_), std::move(callback));
  }
  void cancel(TimerId id) override { timers_.cancel(id); }

  /// Runs the next timer and moves the clock to it. False if there is none.
  bool run_one();
  /// Runs until `done()` is true, checked after each callback, or no timer is left. Returns done().
  bool run_until(const std::function<bool()>& done);
  /// Runs all timers up to and including `end`, then sets the clock to `end`.
  void run_to(TimePoint end);

  /// Number of timers run so far: a measure of work that is the same on every computer.
  [[nodiscard]] std::uint64_t events() const { return events_; }

 private:
  TimePoint now_{};
  std::uint64_t events_ = 0;
  TimerQueue timers_;
};

}  // namespace weft::daemon
