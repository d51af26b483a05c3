#pragma once
// Ordered timers, the part that real and virtual loops share. Pure: time comes from the caller.

#include <optional>
#include <unordered_map>
#include <vector>

#include "drivers/api/loop.hpp"

namespace weft::daemon {

/// Callbacks by due time; those of one instant come out in the order in which they went in.
class TimerQueue {
 public:
  TimerId add(TimePoint when, Loop::Callback callback);
  /// An id that was taken already or never existed is ignored.
  void cancel(TimerId id) { callbacks_.erase(id); }

  /// When the next callback is due; nothing when there is none.
  [[nodiscard]] std::optional<TimePoint> next_due();
  /// Takes the next callback out. There must be one.
  Loop::Callback pop_next();

 private:
  struct Due {
    TimePoint when;
    TimerId id;
    bool operator>(const Due& o) const { return when != o.when ? when > o.when : id > o.id; }
  };

  TimerId last_id_ = 0;
  std::vector<Due> heap_;  ///< cancelled entries stay until they surface
  std::unordered_map<TimerId, Loop::Callback> callbacks_;
};

}  // namespace weft::daemon
