#pragma once
// How a thread shares a busy machine: ahead of others with memory that is not taken away, or behind
// them; and what its end leaves.

#include <malloc.h>

#include <exception>
#include <string>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// What `work` returns, a Result; where it throws, wrong_state with the name of `what` that ended,
/// a run or another thing, and what was thrown.
template <class Work>
auto catch_as_error(const Work& work, const std::string& what = "run") -> decltype(work()) {
  const std::string ours = "a mistake of this program ended the " + what;
  try {
    return work();
  } catch (const std::exception& escaped) {
    return fail({.code = Errc::wrong_state, .where = what, .what = ours, .got = escaped.what()});
  } catch (...) {
    return fail({.code = Errc::wrong_state, .where = what, .what = ours});
  }
}

/// The allocator keeps what a campaign or a training has freed, tens of megabytes, for the next
/// one, which may be a day away. Takes milliseconds; for the thread that did the work, at its end.
/// Source: malloc_trim(3).
inline void give_back_free_memory() {
  malloc_trim(0);
}

/// The calling thread, and those that it makes from here on, run when nobody else wants the
/// processor (SCHED_IDLE); where the system does not permit that, with the least share (nice 19).
void set_low_priority();

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
