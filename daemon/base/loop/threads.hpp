#pragma once
// Priority of threads on a busy computer (real-time priority with locked memory, or low priority),
// and clean-up after their work.

#include <malloc.h>

#include <exception>
#include <string>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// The result of `work`. If it throws: wrong_state with the name `what` of the ended work, such as
/// "run", and the exception.
template <class Work>
auto catch_as_error(const Work& work, const std::string& what = "run") -> decltype(work()) {
  const std::string ours = "internal error ended the " + what;
  try {
    return work();
  } catch (const std::exception& escaped) {
    return fail({.code = Errc::wrong_state, .where = what, .what = ours, .got = escaped.what()});
  } catch (...) {
    return fail({.code = Errc::wrong_state, .where = what, .what = ours});
  }
}

/// Returns freed memory to the system. Otherwise the allocator keeps tens of megabytes of a
/// campaign or a training for the next one, perhaps for a day. Takes milliseconds; call it at the
/// end of the thread that did the work. Source: malloc_trim(3).
inline void give_back_free_memory() {
  malloc_trim(0);
}

/// The calling thread, and those that it makes later, run only when the processor is idle
/// (SCHED_IDLE). If the system does not permit that, they get the least share (nice 19).
void set_low_priority();

/// While it lives, the calling thread has SCHED_FIFO and the process has its memory locked, as far
/// as the system permits. A refusal is no error: the bench then runs less punctually.
class RealTimeScope {
 public:
  /// Priority 1 to 99; a moderate one leaves the kernel's own threads in front.
  explicit RealTimeScope(int priority = 10);
  ~RealTimeScope();
  RealTimeScope(const RealTimeScope&) = delete;
  RealTimeScope& operator=(const RealTimeScope&) = delete;

  [[nodiscard]] bool scheduled() const { return scheduled_; }
  [[nodiscard]] bool locked() const { return locked_; }
  /// The refused permission, the reason, and how to get it; empty if nothing was refused.
  [[nodiscard]] const std::string& advice() const { return advice_; }

 private:
  bool scheduled_ = false;
  bool locked_ = false;
  std::string advice_;
};

/// Gives the calling thread SCHED_FIFO until it ends; later threads and child processes do not
/// inherit it. False if the system does not permit that; RealTimeScope::advice() is the text for
/// people.
bool set_real_time_priority(int priority);

}  // namespace weft::daemon
