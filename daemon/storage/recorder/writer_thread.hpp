#pragma once
// Runs jobs in order on a thread of its own, so that whoever hands them over never waits. The
// thread has a real-time priority where that is permitted, behind the control loop's: other work of
// the machine delays no commit.

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Owned and called by one thread. After a job that fails the jobs behind it are dropped, and
/// every later call returns its error.
class WriterThread {
 public:
  using Job = std::function<Status()>;
  /// Jobs that may wait; one more is an error. Twenty commits a second, each of a chunk per stream
  /// and the commit itself, 4 to 6 jobs, make 35 s and more of a disk that does not answer or of a
  /// file that another program has locked.
  static constexpr std::size_t most_waiting = 4200;

  static constexpr int priority = 5;  ///< of SCHED_FIFO; the control loop has 10

  WriterThread() : thread_([this] { work(); }) {}
  ~WriterThread();  ///< runs what is waiting, then ends the thread
  WriterThread(const WriterThread&) = delete;
  WriterThread& operator=(const WriterThread&) = delete;

  /// Hands a job over; never waits for the thread, not even for its lock. Errors: the first of any
  /// job; io, when too many wait.
  Status post(Job job);
  /// Waits until every job has run. Errors: as above.
  Status drain();

 private:
  void work();
  void handover(std::unique_lock<std::mutex>& lock);

  std::deque<Job> queued_;  ///< of the owner: not handed over yet, because the lock was taken
  std::mutex mutex_;
  std::condition_variable changed_;
  std::condition_variable idle_;
  std::deque<Job> waiting_;
  bool working_ = false;
  bool ending_ = false;
  std::optional<Error> failure_;
  std::thread thread_;
};

}  // namespace weft::daemon
