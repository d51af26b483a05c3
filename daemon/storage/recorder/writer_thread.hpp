#pragma once
// Runs jobs in order on a separate thread, so that the caller never waits. The thread has a
// real-time priority if permitted, below that of the control loop: other work on the machine does
// not delay a commit.

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Owned and called by one thread. After a failed job the remaining jobs are dropped, and every
/// later call returns its error.
class WriterThread {
 public:
  using Job = std::function<Status()>;
  /// Most waiting jobs; one more is an error. There are 20 commits per second of 4 to 6 jobs: one
  /// chunk per stream and the commit. So this covers at least 35 s of a disk that does not respond
  /// or a file that another program has locked.
  static constexpr std::size_t most_waiting = 4200;

  static constexpr int priority = 5;  ///< for SCHED_FIFO; the control loop has 10

  WriterThread() : thread_([this] { work(); }) {}
  ~WriterThread();  ///< runs the waiting jobs, then ends the thread
  WriterThread(const WriterThread&) = delete;
  WriterThread& operator=(const WriterThread&) = delete;

  /// Queues a job; never waits for the thread, not even for its lock. Errors: the first of any job;
  /// io if too many jobs wait.
  Status post(Job job);
  /// Waits until every job has run. Errors: as above.
  Status drain();

 private:
  void work();
  void handover(std::unique_lock<std::mutex>& lock);

  std::deque<Job> queued_;  ///< used by the owner only: jobs not yet passed on because the lock was
                            ///< taken
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
