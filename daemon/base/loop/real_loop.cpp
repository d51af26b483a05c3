#include "daemon/base/loop/real_loop.hpp"

#include <algorithm>
#include <asio/executor_work_guard.hpp>
#include <asio/io_context.hpp>
#include <asio/steady_timer.hpp>

namespace weft::daemon {
namespace {

using Clock = std::chrono::steady_clock;

// More consecutive handlers than this would delay a due timer: a flooded port must not stop the
// control cycle.
constexpr int most_handlers = 64;

}  // namespace

struct RealLoop::Parts {
  void serve_ports() {
    for (int i = 0; i < most_handlers && context.poll_one() != 0; ++i) {
    }
  }

  // Waits for a port or for `until`, whichever comes first.
  void wait(TimePoint until) {
    alarm.expires_at(origin + until.time_since_epoch());
    bool rung = false;
    alarm.async_wait([&rung](const asio::error_code&) { rung = true; });
    context.run_one();
    if (rung) return;
    alarm.cancel();
    while (!rung) context.run_one();
  }

  Clock::time_point origin = Clock::now();
  asio::io_context context{1};
  asio::executor_work_guard<asio::io_context::executor_type> open_ports =
      asio::make_work_guard(context);  ///< makes it wait even without an open port
  asio::steady_timer alarm{context};
  TimerQueue timers;
};

RealLoop::RealLoop() : parts_(std::make_unique<Parts>()) {}
RealLoop::~RealLoop() = default;

TimePoint RealLoop::now() const {
  return TimePoint(std::chrono::duration_cast<Duration>(Clock::now() - parts_->origin));
}

TimerId RealLoop::at(TimePoint when, Callback callback) {
  return parts_->timers.add(std::max(when, now()), std::move(callback));
}

void RealLoop::cancel(TimerId id) {
  parts_->timers.cancel(id);
}

void RealLoop::run_until(const std::function<bool()>& done) {
  while (!done()) {
    parts_->serve_ports();
    if (done()) return;
    const TimePoint present = now();
    const std::optional<TimePoint> due = parts_->timers.next_due();
    if (due && *due <= present)
      parts_->timers.pop_next()();
    else
      parts_->wait(std::min(due.value_or(present + longest_wait), present + longest_wait));
  }
}

asio::io_context& RealLoop::ports() {
  return parts_->context;
}

}  // namespace weft::daemon
