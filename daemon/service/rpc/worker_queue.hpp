#pragma once
// Runs work that would delay the server's thread, and with it a halt: one at a time, on its own
// thread.

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#include "daemon/base/loop/threads.hpp"

namespace weft::daemon::server {

class WorkerQueue {
 public:
  /// Tasks that may wait while one is running [count].
  static constexpr std::size_t most_waiting = 32;

  /// Rest of the work, to be run on the server's thread afterwards.
  using Report = std::function<void()>;
  using Work = std::function<Report()>;
  /// Called instead of the report if the work threw.
  using Failed = std::function<void(const Error&)>;
  /// `post` passes a report to the server's thread; it must be callable from any thread.
  explicit WorkerQueue(std::function<void(Report)> post)
      : post_(std::move(post)), thread_([this](const std::stop_token& stop) { run(stop); }) {}
  ~WorkerQueue() = default;  ///< waits for the running task; drops waiting ones
  WorkerQueue(const WorkerQueue&) = delete;
  WorkerQueue& operator=(const WorkerQueue&) = delete;

  /// False if too many tasks are waiting.
  bool send(Work work, Failed failed);

 private:
  struct BackgroundTask {
    Work work;
    Failed failed;
  };
  void run(const std::stop_token& stop);

  std::function<void(Report)> post_;
  std::mutex mutex_;
  std::condition_variable_any arrived_;
  std::deque<BackgroundTask> waiting_;
  std::jthread thread_;  // last: it uses all other members
};

inline bool WorkerQueue::send(Work work, Failed failed) {
  const std::lock_guard lock(mutex_);
  if (waiting_.size() >= most_waiting) return false;
  waiting_.push_back({std::move(work), std::move(failed)});
  arrived_.notify_one();
  return true;
}

inline void WorkerQueue::run(const std::stop_token& stop) {
  while (true) {
    std::unique_lock lock(mutex_);
    if (!arrived_.wait(lock, stop, [this] { return !waiting_.empty(); })) return;
    const BackgroundTask background = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    const auto report =
        catch_as_error([&]() -> Result<Report> { return background.work(); }, "errand");
    post_(report ? *report : [failed = background.failed, why = report.error()] { failed(why); });
    if (stop.stop_requested()) return;
  }
}

}  // namespace weft::daemon::server
