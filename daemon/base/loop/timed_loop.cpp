#include "daemon/base/loop/timed_loop.hpp"

#include <algorithm>
#include <utility>

#include "daemon/base/loop/wall_clock.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

TimerId TimedLoop::at(TimePoint when, Callback callback) {
  if (++count_ % stride != 0) return inner_->at(when, std::move(callback));
  return inner_->at(when, [this, callback = std::move(callback)] {
    const auto begin = steady_wall_now();
    callback();
    spent_ += stride * (steady_wall_now() - begin);
  });
}

TimerId TimerQueue::add(TimePoint when, Loop::Callback&& callback) {
  if (free_.empty()) {
    free_.push_back(slots_.size());
    slots_.emplace_back();
  }
  const std::size_t slot = free_.back();
  free_.pop_back();
  WEFT_ASSERT(slot >> slot_bits == 0);  // otherwise an id would name another timer
  const TimerId id = ++last_number_ << slot_bits | slot;
  slots_[slot].id = id;
  slots_[slot].callback.swap(callback);  // the callback of a free slot is empty
  heap_.push_back({when, id});
  std::push_heap(heap_.begin(), heap_.end(), std::greater<>{});
  return id;
}

/// Moves the callback out: destroying it may cancel timers.
Loop::Callback TimerQueue::release(TimerId id) {
  Slot& slot = slots_[slot_of(id)];
  slot.id = 0;
  free_.push_back(slot_of(id));
  Loop::Callback callback;
  callback.swap(slot.callback);
  return callback;
}

std::optional<TimePoint> TimerQueue::next_due() {
  while (!heap_.empty() && !is_waiting(heap_.front().id)) {
    std::pop_heap(heap_.begin(), heap_.end(), std::greater<>{});
    heap_.pop_back();
  }
  if (heap_.empty()) return std::nullopt;
  return heap_.front().when;
}

Loop::Callback TimerQueue::pop_next() {
  const TimerId id = heap_.front().id;
  std::pop_heap(heap_.begin(), heap_.end(), std::greater<>{});
  heap_.pop_back();
  return release(id);
}

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
