#include "daemon/base/loop/virtual_loop.hpp"

namespace weft::daemon {

bool VirtualLoop::run_one() {
  const std::optional<TimePoint> due = timers_.next_due();
  if (!due) return false;
  const Callback callback = timers_.pop_next();
  now_ = *due;
  ++events_;
  callback();
  return true;
}

bool VirtualLoop::run_until(const std::function<bool()>& done) {
  while (!done())
    if (!run_one()) return done();
  return true;
}

void VirtualLoop::run_to(TimePoint end) {
  for (auto due = timers_.next_due(); due && *due <= end; due = timers_.next_due()) run_one();
  now_ = std::max(now_, end);
}

}  // namespace weft::daemon
