#pragma once
// Timers that cannot outlive their owner: both cancel themselves when destroyed.

#include <optional>
#include <utility>

#include "drivers/api/loop.hpp"

namespace weft {

/// One timer with one callback; starting it again moves it.
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

/// Calls back when nothing has come in time. Feeding it costs one comparison and no timer call, so
/// that a stream of thousands of frames a second may do it: a timer that finds itself early sleeps
/// on.
class Watchdog {
 public:
  Watchdog(Loop& loop, Loop::Callback expired)
      : loop_(&loop), expired_(std::move(expired)), timer_(loop, [this] { poll(); }) {}

  /// Something must come within `limit` from now.
  void expect_within(Duration limit) {
    deadline_ = loop_->now() + limit;
    waiting_ = true;
    if (!timer_.pending() || deadline_ < timer_due_) wake_at_deadline();
  }
  /// As above, unless something is awaited already.
  void expect_reply_within(Duration limit) {
    if (!waiting_) expect_within(limit);
  }
  /// It came. The timer is left to run out.
  void satisfy() { waiting_ = false; }
  /// Nothing is awaited and no timer is left.
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
