#include "daemon/campaign/live_frame_sampler.hpp"

#include <algorithm>
#include <utility>

namespace weft::daemon {

void LiveFrameSampler::set_active(bool on) {
  if (on_.exchange(on, std::memory_order_relaxed) == on) return;
  const std::lock_guard lock(mutex_);
  frame_.reset();
  activation_.fetch_add(1, std::memory_order_relaxed);
  wanted_.store(on, std::memory_order_relaxed);
}

void LiveFrameSampler::begin() {
  const std::lock_guard lock(mutex_);
  frame_.reset();
  next_ = {};
  pressed_ = false;
  wanted_.store(on_.load(std::memory_order_relaxed), std::memory_order_relaxed);
}

void LiveFrameSampler::discard_old_frame() {
  const unsigned activation_now = activation_.load(std::memory_order_relaxed);
  if (activation_now == sampled_activation_) return;
  sampled_activation_ = activation_now;
  next_ = {};
  pressed_ = false;
}

std::optional<LiveFrame> LiveFrameSampler::take() {
  const std::lock_guard lock(mutex_);
  auto out = std::exchange(frame_, std::nullopt);
  if (out) wanted_.store(on_.load(std::memory_order_relaxed), std::memory_order_relaxed);
  return out;
}

void LiveFrameSampler::on_sample(const Sample& sample) {
  if (!on_.load(std::memory_order_relaxed)) return;
  discard_old_frame();
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
void LiveFrameSampler::handover(const Snapshot& seen, TimePoint now) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock || !wanted_.load(std::memory_order_relaxed)) return;
  discard_old_frame();
  next_.bench_s = to_seconds(now);
  bool all_known = true;
  for (std::size_t i = 0; i < seen.stage_at.size(); ++i)
    all_known = all_known && (seen.fixed[i] || seen.stage_at[i].has_value());
  if (all_known) next_.joints = seen.joints();
  frame_ = std::exchange(next_, {});
  pressed_ = false;
  wanted_.store(false, std::memory_order_relaxed);
}

}  // namespace weft::daemon
