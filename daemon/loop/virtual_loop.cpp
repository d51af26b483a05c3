#include "daemon/loop/virtual_loop.hpp"

#include <algorithm>
#include <utility>

namespace weft::daemon {

TimerId VirtualLoop::at(TimePoint when, Callback callback) {
  const TimerId id = ++last_id_;
  callbacks_.emplace(id, std::move(callback));
  queue_.push_back({std::max(when, now_), id});
  std::push_heap(queue_.begin(), queue_.end(), std::greater<>{});
  return id;
}

// Drops cancelled timers from the top; true when a live one is left there.
bool VirtualLoop::next_due(TimePoint& when) {
  while (!queue_.empty() && !callbacks_.contains(queue_.front().id)) {
    std::pop_heap(queue_.begin(), queue_.end(), std::greater<>{});
    queue_.pop_back();
  }
  if (queue_.empty()) return false;
  when = queue_.front().when;
  return true;
}

bool VirtualLoop::run_one() {
  TimePoint when;
  if (!next_due(when)) return false;
  std::pop_heap(queue_.begin(), queue_.end(), std::greater<>{});
  auto node = callbacks_.extract(queue_.back().id);
  queue_.pop_back();
  now_ = when;
  ++events_;
  node.mapped()();
  return true;
}

bool VirtualLoop::run_until(const std::function<bool()>& done) {
  while (!done())
    if (!run_one()) return done();
  return true;
}

void VirtualLoop::run_to(TimePoint end) {
  TimePoint when;
  while (next_due(when) && when <= end) run_one();
  now_ = std::max(now_, end);
}

}  // namespace weft::daemon
