#pragma once
// Tells where the wall time of a virtual run goes: a view of a loop that times the callbacks set
// through it.

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "drivers/api/timer.hpp"

namespace weft::daemon {

/// Callbacks by due time; those of one instant come out in the order in which they went in.
/// Callbacks lie in reused slots, so that a long run neither hashes nor allocates per timer.
class TimerQueue {
 public:
  TimerId add(TimePoint when, Loop::Callback&& callback);
  /// An id that was taken already or never existed is ignored.
  void cancel(TimerId id) {
    if (is_waiting(id)) release(id);
  }

  /// When the next callback is due; nothing when there is none.
  [[nodiscard]] std::optional<TimePoint> next_due();
  /// Takes the next callback out. There must be one, which next_due() has just found.
  Loop::Callback pop_next();

 private:
  /// An id is a running number over the slot: ids ascend, and no two timers share one.
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
  std::vector<Due> heap_;  ///< cancelled entries stay until they surface
  std::vector<Slot> slots_;
  std::vector<std::size_t> free_;
};

/// Times one callback in `stride` and scales: an estimate, so that measuring stays well under the
/// work measured.
class TimedLoop final : public Loop {
 public:
  explicit TimedLoop(Loop& inner) : inner_(&inner) {}
  [[nodiscard]] TimePoint now() const override { return inner_->now(); }
  TimerId at(TimePoint when, Callback callback) override;
  void cancel(TimerId id) override { inner_->cancel(id); }

  /// Estimated seconds spent in callbacks so far.
  [[nodiscard]] double seconds() const { return std::chrono::duration<double>(spent_).count(); }

 private:
  static constexpr unsigned stride = 64;
  Loop* inner_;
  unsigned count_ = 0;
  std::chrono::nanoseconds spent_{};
};

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
