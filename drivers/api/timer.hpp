#pragma once
// The only source of time and timers, and timers that cannot outlive their owner. daemon/base/loop
// has two loops: real (Asio) and virtual (ordered timers; when idle, it jumps to the next).

#include <cstdint>
#include <functional>
#include <optional>
#include <utility>

#include "protocols/base/time.hpp"

namespace weft {

using TimerId = std::uint64_t;

/// Thread-bound: all calls and callbacks happen on the loop's own thread.
class Loop {
 public:
  using Callback = std::function<void()>;

  virtual ~Loop() = default;
  [[nodiscard]] virtual TimePoint now() const = 0;
  /// Runs `callback` once at `when`. If `when` is past, it runs after the queued callbacks.
  /// Callbacks due at the same instant run in the order of the calls.
  virtual TimerId at(TimePoint when, Callback callback) = 0;
  /// Cancels a timer; an id that already ran or never existed is ignored.
  virtual void cancel(TimerId id) = 0;

  TimerId after(Duration delay, Callback callback) {
    return at(now() + delay, std::move(callback));
  }
};

/// One timer with one callback. The destructor cancels it; start() again restarts it.
class Timer {
 public:
  Timer(Loop& loop, Loop::Callback callback) : loop_(&loop), callback_(std::move(callback)) {}
  ~Timer() { cancel(); }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;

  void start(Duration delay) {
    cancel();
    id_ = loop_->after(delay, [this] { run(); });
  }
  void cancel() {
    if (id_) loop_->cancel(*std::exchange(id_, std::nullopt));
  }
  [[nodiscard]] bool pending() const { return id_.has_value(); }

 private:
  void run() {
    id_.reset();
    callback_();
  }

  Loop* loop_;
  Loop::Callback callback_;
  std::optional<TimerId> id_;
};

/// Calls back if no reply or frame arrives in time; the destructor cancels it. Feeding it costs one
/// comparison and no timer call, so it is cheap for thousands of frames per second: a timer that
/// fires early starts again.
class Watchdog {
 public:
  Watchdog(Loop& loop, Loop::Callback expired)
      : loop_(&loop), expired_(std::move(expired)), timer_(loop, [this] { poll(); }) {}

  /// Expects the next satisfy() or expect_within() within `limit` from now.
  void expect_within(Duration limit) {
    deadline_ = loop_->now() + limit;
    waiting_ = true;
    if (!timer_.pending() || deadline_ < timer_due_) wake_at_deadline();
  }
  /// As above, unless a deadline is pending already.
  void expect_reply_within(Duration limit) {
    if (!waiting_) expect_within(limit);
  }
  /// The expected data has arrived. The timer is not cancelled; it expires without effect.
  void satisfy() { waiting_ = false; }
  /// Cancels the deadline and the timer.
  void stop() {
    waiting_ = false;
    timer_.cancel();
  }

 private:
  void poll() {
    if (!waiting_) return;
    if (deadline_ > loop_->now()) return wake_at_deadline();
    waiting_ = false;
    expired_();
  }
  void wake_at_deadline() {
    timer_due_ = deadline_;
    timer_.start(deadline_ - loop_->now());
  }

  Loop* loop_;
  Loop::Callback expired_;
  Timer timer_;
  TimePoint deadline_{};
  TimePoint timer_due_{};
  bool waiting_ = false;
};

}  // namespace weft
