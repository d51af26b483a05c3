#include "daemon/campaign/onlooker.hpp"

#include <algorithm>
#include <utility>

namespace weft::daemon {

void Onlooker::look(bool on) {
  if (on_.exchange(on, std::memory_order_relaxed) == on) return;
  const std::lock_guard lock(mutex_);
  frame_.reset();
  look_.fetch_add(1, std::memory_order_relaxed);
  wanted_.store(on, std::memory_order_relaxed);
}

void Onlooker::begin() {
  const std::lock_guard lock(mutex_);
  frame_.reset();
  next_ = {};
  pressed_ = false;
  wanted_.store(on_.load(std::memory_order_relaxed), std::memory_order_relaxed);
}

void Onlooker::forget_old_look() {
  const unsigned look = look_.load(std::memory_order_relaxed);
  if (look == heard_look_) return;
  heard_look_ = look;
  next_ = {};
  pressed_ = false;
}

std::optional<LiveFrame> Onlooker::take() {
  const std::lock_guard lock(mutex_);
  auto out = std::exchange(frame_, std::nullopt);
  if (out) wanted_.store(on_.load(std::memory_order_relaxed), std::memory_order_relaxed);
  return out;
}

void Onlooker::hear(const Sample& sample) {
  if (!on_.load(std::memory_order_relaxed)) return;
  forget_old_look();
  if (const auto* const taxels = std::get_if<TaxelSample>(&sample.value)) {
    next_.taxels.assign(taxels->counts.begin(), taxels->counts.end());
  } else if (const auto* const wrench = std::get_if<WrenchSample>(&sample.value)) {
    const double fz_n = wrench->force_n[2];
    next_.least_fz_n = pressed_ ? std::min(next_.least_fz_n, fz_n) : fz_n;
    next_.most_fz_n = pressed_ ? std::max(next_.most_fz_n, fz_n) : fz_n;
    next_.wrench = *wrench;
    pressed_ = true;
  }
}

// The looking thread may hold the mutex: then the next event of the bench tries again.
void Onlooker::hand_over(const Snapshot& seen, TimePoint now) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock || !wanted_.load(std::memory_order_relaxed)) return;
  forget_old_look();
  next_.bench_s = to_seconds(now);
  const bool all_known = std::all_of(seen.stage_at.begin(), seen.stage_at.end(),
                                     [](const auto& at) { return at.has_value(); });
  if (all_known) next_.joints = seen.joints();
  frame_ = std::exchange(next_, {});
  pressed_ = false;
  wanted_.store(false, std::memory_order_relaxed);
}

}  // namespace weft::daemon
