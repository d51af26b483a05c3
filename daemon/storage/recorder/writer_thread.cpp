#include "daemon/storage/recorder/writer_thread.hpp"

#include <iterator>
#include <utility>

#include "daemon/base/loop/threads.hpp"

namespace weft::daemon {

WriterThread::~WriterThread() {
  {
    std::unique_lock lock(mutex_);
    handover(lock);
    ending_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void WriterThread::handover(std::unique_lock<std::mutex>&) {
  waiting_.insert(waiting_.end(), std::make_move_iterator(queued_.begin()),
                  std::make_move_iterator(queued_.end()));
  queued_.clear();
}

Status WriterThread::post(Job job) {
  queued_.push_back(std::move(job));
  std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return {};
  if (failure_) return tl::unexpected<Error>(*failure_);
  handover(lock);
  if (waiting_.size() > most_waiting)
    failure_ = Error{.code = Errc::io, .what = "disk too slow for the recording"};
  lock.unlock();
  changed_.notify_one();
  return {};
}

Status WriterThread::drain() {
  std::unique_lock lock(mutex_);
  handover(lock);
  changed_.notify_one();
  idle_.wait(lock, [this] { return waiting_.empty() && !working_; });
  if (failure_) return tl::unexpected<Error>(*failure_);
  return {};
}

void WriterThread::work() {
  set_real_time_priority(priority);
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return !waiting_.empty() || ending_; });
    if (waiting_.empty()) return;
    const Job job = std::move(waiting_.front());
    waiting_.pop_front();
    if (!failure_) {
      working_ = true;
      lock.unlock();
      Status done = job();
      lock.lock();
      working_ = false;
      if (!done && !failure_) failure_ = std::move(done).error();
    }
    if (waiting_.empty()) idle_.notify_all();
  }
}

}  // namespace weft::daemon
