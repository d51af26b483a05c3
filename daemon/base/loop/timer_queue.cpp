#include "daemon/base/loop/timer_queue.hpp"

#include <algorithm>
#include <utility>

namespace weft::daemon {

TimerId TimerQueue::add(TimePoint when, Loop::Callback callback) {
  const TimerId id = ++last_id_;
  callbacks_.emplace(id, std::move(callback));
  heap_.push_back({when, id});
  std::push_heap(heap_.begin(), heap_.end(), std::greater<>{});
  return id;
}

std::optional<TimePoint> TimerQueue::next_due() {
  while (!heap_.empty() && !callbacks_.contains(heap_.front().id)) {
    std::pop_heap(heap_.begin(), heap_.end(), std::greater<>{});
    heap_.pop_back();
  }
  if (heap_.empty()) return std::nullopt;
  return heap_.front().when;
}

Loop::Callback TimerQueue::pop_next() {
  std::pop_heap(heap_.begin(), heap_.end(), std::greater<>{});
  auto node = callbacks_.extract(heap_.back().id);
  heap_.pop_back();
  return std::move(node.mapped());
}

}  // namespace weft::daemon
