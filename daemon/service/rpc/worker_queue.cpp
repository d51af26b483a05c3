#include "daemon/service/rpc/worker_queue.hpp"

#include <utility>

#include "daemon/base/loop/threads.hpp"

namespace weft::daemon::server {

WorkerQueue::WorkerQueue(std::function<void(Report)> post)
    : post_(std::move(post)), thread_([this](const std::stop_token& stop) { run(stop); }) {}

WorkerQueue::~WorkerQueue() = default;

bool WorkerQueue::send(Work work, Failed failed) {
  const std::lock_guard lock(mutex_);
  if (waiting_.size() >= most_waiting) return false;
  waiting_.push_back({std::move(work), std::move(failed)});
  arrived_.notify_one();
  return true;
}

void WorkerQueue::run(const std::stop_token& stop) {
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
