#include "daemon/hardware/plugins/plugin_watch.hpp"

#include <algorithm>
#include <utility>

namespace weft::daemon {

PluginWatch::PluginWatch(Limits limits, Hung hung)
    : limits_(limits), hung_(std::move(hung)), thread_([this] { watch(); }) {}

PluginWatch::~PluginWatch() {
  {
    const std::lock_guard lock(guard_);
    ending_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

// Counts ticks instead of reading a clock: a machine that sleeps does not make a plugin late.
void PluginWatch::watch() {
  const auto tick = std::max(limits_.late / 8, std::chrono::milliseconds(1));
  std::unique_lock lock(guard_);
  while (!wake_.wait_for(lock, tick, [this] { return ending_; })) {
    if (turn_ == nullptr || turn_->call_ == nullptr) continue;
    const auto before = turn_->lasted_;
    turn_->lasted_ += tick;
    if (before < limits_.hung && turn_->lasted_ >= limits_.hung) hung_(*turn_->call_);
  }
}

PluginWatch::Turn::Turn(PluginWatch& watch, const PluginCall* call) : watch_(&watch), call_(call) {
  const std::lock_guard lock(watch_->guard_);
  outer_ = std::exchange(watch_->turn_, this);
}

PluginWatch::Turn::~Turn() {
  const std::lock_guard lock(watch_->guard_);
  watch_->turn_ = outer_;
}

bool PluginWatch::Turn::late() const {
  const std::lock_guard lock(watch_->guard_);
  return lasted_ >= watch_->limits_.late;
}

}  // namespace weft::daemon
