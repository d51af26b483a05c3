#pragma once
// What a process needs to keep time on a busy machine: a real-time priority, and memory that is
// not taken away.

#include <string>

namespace weft::daemon {

/// While it lives the calling thread has SCHED_FIFO and the process its memory locked, as far as
/// the system permits; a refusal is no error: the bench runs without, less punctually.
class RealTimeScope {
 public:
  /// Priority 1 to 99; a moderate one leaves the kernel's own threads in front.
  explicit RealTimeScope(int priority = 10);
  ~RealTimeScope();
  RealTimeScope(const RealTimeScope&) = delete;
  RealTimeScope& operator=(const RealTimeScope&) = delete;

  [[nodiscard]] bool scheduled() const { return scheduled_; }
  [[nodiscard]] bool locked() const { return locked_; }
  /// What was not got, why, and how to get it; empty when all was.
  [[nodiscard]] const std::string& advice() const { return advice_; }

 private:
  bool scheduled_ = false;
  bool locked_ = false;
  std::string advice_;
};

/// Gives the calling thread SCHED_FIFO until it ends; threads and children made later do not
/// inherit it. False where the system does not permit that: RealTimeScope::advice() has told
/// people.
bool set_real_time_priority(int priority);

}  // namespace weft::daemon
