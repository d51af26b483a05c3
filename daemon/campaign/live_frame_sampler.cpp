#include "daemon/campaign/live_frame_sampler.hpp"

#include <algorithm>
#include <utility>

namespace weft::daemon {

void LiveFrameSampler::Gathered::add(const WrenchSample& sample) {
  const double fz_n = sample.force_n[2];
  least_fz_n = wrench ? std::min(least_fz_n, fz_n) : fz_n;
  most_fz_n = wrench ? std::max(most_fz_n, fz_n) : fz_n;
  wrench = sample;
}

void LiveFrameSampler::Rest::add(std::span<const std::uint16_t> counts, bool at_rest) {
  if (!std::exchange(at_rest_, at_rest)) {
    if (!at_rest) return;
    sums_.assign(counts.size(), 0);
    frames_ = 0;
  }
  if (!at_rest || counts.size() != sums_.size()) return;
  for (std::size_t pad = 0; pad < counts.size(); ++pad) sums_[pad] += counts[pad];
  ++frames_;
}

std::vector<double> LiveFrameSampler::Rest::means() const {
  std::vector<double> out;
  if (frames_ == 0) return out;
  for (const double sum : sums_) out.push_back(sum / static_cast<double>(frames_));
  return out;
}

std::optional<LiveFrame> LiveFrameSampler::take() {
  const std::lock_guard lock(mutex_);
  auto out = std::exchange(frame_, std::nullopt);
  wanted_.store(true, std::memory_order_relaxed);
  return out;
}

LiveHistory LiveFrameSampler::history(double after_s) const {
  const std::lock_guard lock(mutex_);
  const auto from = std::ranges::upper_bound(history_, after_s, {}, &LiveFrame::bench_s);
  LiveHistory out{run_, {from, history_.end()}};
  if (out.rows.empty()) return out;
  out.rows.back().taxels = newest_taxels_.taxels;
  out.rows.back().rest_counts = newest_taxels_.rest_counts;
  return out;
}

void LiveFrameSampler::begin(std::string run) {
  const std::lock_guard lock(mutex_);
  run_ = std::move(run);
  frame_.reset();
  history_.clear();
  newest_taxels_ = {};
  since_frame_ = since_row_ = {};
  rest_.clear();
  phase_ = Phase::none;
  regulated_ = {};
  last_row_.reset();
  wanted_.store(true, std::memory_order_relaxed);
}

void LiveFrameSampler::begin_trial(const recipes::Exploration& exploration) {
  regulated_ = {};
  for (const recipes::PhaseStep& step : exploration.phases) {
    if (step.phase == Phase::press) regulated_[0] = step;
    if (step.phase == Phase::motion) regulated_[1] = step;
  }
}

void LiveFrameSampler::on_sample(const Sample& sample, Phase phase) {
  phase_ = phase;
  if (const auto* const taxels = std::get_if<TaxelSample>(&sample.value)) {
    since_frame_.taxels.assign(taxels->counts.begin(), taxels->counts.end());
    rest_.add(taxels->counts, phase == Phase::rest);
  } else if (const auto* const wrench = std::get_if<WrenchSample>(&sample.value)) {
    since_frame_.add(*wrench);
    since_row_.add(*wrench);
  }
}

LiveFrame LiveFrameSampler::make_frame(const Snapshot& seen, TimePoint now,
                                       Gathered& gathered) const {
  LiveFrame out;
  out.bench_s = to_seconds(now);
  out.phase = phase_;
  if (phase_ == Phase::press || phase_ == Phase::motion) {
    const recipes::PhaseStep& step = regulated_[phase_ == Phase::press ? 0 : 1];
    out.force_n = step.force_n;
    out.force_band_n = step.force_band_n;
  }
  out.wrench = gathered.wrench;
  out.least_fz_n = gathered.least_fz_n;
  out.most_fz_n = gathered.most_fz_n;
  out.taxels = std::move(gathered.taxels);
  bool all_known = true;
  for (std::size_t i = 0; i < seen.stage_at.size(); ++i)
    all_known = all_known && (seen.fixed[i] || seen.stage_at[i].has_value());
  if (all_known) out.joints = seen.joints();
  gathered = {};
  return out;
}

// The viewer's thread may hold the mutex: the next event of the bench tries again.
void LiveFrameSampler::show(const Snapshot& seen, TimePoint now) {
  const bool is_row_due = !last_row_ || to_seconds(now - *last_row_) >= history_step_s;
  if (!is_row_due && !wanted_.load(std::memory_order_relaxed)) return;
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return;
  if (is_row_due) {
    last_row_ = now;
    history_.push_back(make_frame(seen, now, since_row_));
    if (history_.size() > most_history) history_.pop_front();
  }
  if (!wanted_.exchange(false, std::memory_order_relaxed)) return;
  frame_ = make_frame(seen, now, since_frame_);
  if (frame_->taxels.empty()) return;
  frame_->rest_counts = rest_.means();
  newest_taxels_.taxels = frame_->taxels;
  newest_taxels_.rest_counts = frame_->rest_counts;
}

}  // namespace weft::daemon
