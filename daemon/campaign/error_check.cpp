#include "daemon/campaign/error_check.hpp"

#include <algorithm>
#include <cmath>

namespace weft::daemon {

void merge(const SimulationError& one, SimulationError& total) {
  const sim::RunError& found = one.worst;
  sim::RunError& worst = total.worst;
  if (total.trials == 0 || found.force_max_n > worst.force_max_n) {
    total.worst_fabric = one.worst_fabric;
    total.worst_exploration = one.worst_exploration;
    total.worst_phase = one.worst_phase;
    total.worst_at_s = one.worst_at_s;
    worst.worst_at = found.worst_at;
  }
  const double before = static_cast<double>(worst.samples),
               more = static_cast<double>(found.samples);
  const auto largest = [&](double& a, double b) { a = std::max(a, b); };
  const auto rms = [&](double& a, double b) {
    if (before + more > 0) a = std::sqrt((before * a * a + more * b * b) / (before + more));
  };
  largest(worst.force_max_n, found.force_max_n);
  largest(worst.friction_max_n, found.friction_max_n);
  largest(worst.counts_max, found.counts_max);
  largest(worst.anywhere_max_n, found.anywhere_max_n);
  largest(worst.unled_max_n, found.unled_max_n);
  largest(worst.uncertainty_n, found.uncertainty_n);
  worst.pads = found.pads;
  worst.is_doubled = found.is_doubled;
  worst.is_resolved = worst.is_resolved && found.is_resolved;
  rms(worst.force_rms_n, found.force_rms_n);
  rms(worst.friction_rms_n, found.friction_rms_n);
  rms(worst.counts_rms, found.counts_rms);
  rms(worst.unled_rms_n, found.unled_rms_n);
  worst.samples += found.samples;
  worst.setting = found.setting;
  worst.reference = found.reference;
  total.trials += one.trials;
  total.pairs.insert(one.pairs.begin(), one.pairs.end());
  if (one.resolved.force_n > total.resolved.force_n) total.resolved = one.resolved;
}

namespace {

/// For a trial without taxels: the ends of the frames while it was recorded.
std::vector<TimePoint> recorded_frames(const std::vector<PhaseStart>& phases, TimePoint end) {
  std::vector<TimePoint> out;
  for (std::size_t i = 0; i < phases.size(); ++i) {
    if (phases[i].phase == Phase::none) continue;
    const TimePoint until = i + 1 < phases.size() ? phases[i + 1].at : end;
    const auto first = sim::BenchPlant::frame_at_or_after(phases[i].at);
    for (auto frame = first; sim::BenchPlant::frame_start(frame) < until; ++frame)
      out.push_back(sim::BenchPlant::frame_start(frame));
  }
  return out;
}

}  // namespace

bool ErrorCheck::has_fabric(std::size_t fabric) const {
  return std::ranges::any_of(seen_, [&](const Pair& pair) { return pair.first == fabric; });
}

bool ErrorCheck::has_exploration(std::size_t exploration) const {
  return std::ranges::any_of(seen_, [&](const Pair& pair) { return pair.second == exploration; });
}

bool ErrorCheck::is_wanted(const recipes::TrialSpec& spec) const {
  if (trials_.size() >= most_trials) return false;
  if (accuracy_n_) return !seen_.contains({spec.fabric, spec.exploration});
  return !has_fabric(spec.fabric) || !has_exploration(spec.exploration);
}

bool ErrorCheck::has_all() const {
  if (trials_.size() >= most_trials) return true;
  if (accuracy_n_) return seen_.size() >= pairs_;
  for (std::size_t i = 0; i < plan_->fabrics.size(); ++i)
    if (!has_fabric(i)) return false;
  for (std::size_t i = 0; i < plan_->explorations.size(); ++i)
    if (!has_exploration(i)) return false;
  return true;
}

void ErrorCheck::patch_follows() {
  if (rig_ != nullptr) rig_->record_motion(!has_all());
}

void ErrorCheck::trial_done(std::size_t trial, bool complete, TimePoint now,
                            const TrialRecording& recording) {
  if (rig_ == nullptr) return;
  auto motion = rig_->extract_motion(now);
  const recipes::TrialSpec& spec = plan_->trials[trial];
  if (!motion || !complete || !is_wanted(spec)) return;
  seen_.insert({spec.fabric, spec.exploration});
  sim::SampleTimes sampled{recording.sampled(), recording.wrench_sampled()};
  if (sampled.pads.empty()) sampled.pads = recorded_frames(recording.phases(), now);
  trials_.push_back({trial, std::move(*motion), std::move(sampled), recording.phases()});
}

SimulationError ErrorCheck::error_of(const StoredTrial& stored) const {
  const recipes::TrialSpec& spec = plan_->trials[stored.trial];
  SimulationError out;
  out.worst = rig_->run_error(stored.motion, stored.sampled, accuracy_n_);
  out.worst_fabric = plan_->fabrics[spec.fabric];
  out.worst_exploration = plan_->explorations[spec.exploration].name;
  out.trials = 1;
  if (out.worst.samples > 0) out.pairs.insert({out.worst_fabric, out.worst_exploration});
  // A sample belongs to a frame that ended earlier: the first may be from before the phase.
  std::optional<TimePoint> began;
  for (const PhaseStart& start : stored.phases) {
    if (start.phase == Phase::none) continue;
    if (began && start.at > out.worst.worst_at) break;
    if (!began) began = start.at;
    out.worst_phase = to_char(start.phase);
  }
  if (began) out.worst_at_s = std::max(0.0, to_seconds(out.worst.worst_at - *began));
  if (out.worst.is_resolved) out.resolved = out.largest();
  return out;
}

std::vector<SimulationError> ErrorCheck::errors(std::vector<SimulationError> before) const {
  for (const StoredTrial& stored : trials_) {
    before.resize(1);
    merge(error_of(stored), before.front());
  }
  return before;
}

}  // namespace weft::daemon
