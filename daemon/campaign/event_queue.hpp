#pragma once
// Events that the effects of a machine cause wait in line, so that the machine never runs inside
// itself.

#include <deque>
#include <functional>
#include <utility>

namespace weft::daemon {

template <class Event>
class EventQueue {
 public:
  /// Takes `event` and, unless a call further out does so, hands it and all that it causes to
  /// `take`, one after the other.
  void dispatch(Event event, const std::function<void(const Event&)>& take) {
    waiting_.push_back(std::move(event));
    if (std::exchange(dispatching_, true)) return;
    while (!waiting_.empty()) {
      const Event next = std::move(waiting_.front());
      waiting_.pop_front();
      take(next);
    }
    dispatching_ = false;
  }

 private:
  std::deque<Event> waiting_;
  bool dispatching_ = false;
};

}  // namespace weft::daemon
