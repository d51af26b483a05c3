#include "daemon/campaign/error_check.hpp"

#include <algorithm>
#include <cmath>

namespace weft::daemon {
namespace {

void merge(const sim::RunError& found, const std::string& fabric, SimulationError& total) {
  sim::RunError& worst = total.worst;
  if (total.trials == 0 || found.force_max_n > worst.force_max_n) total.worst_fabric = fabric;
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
  rms(worst.force_rms_n, found.force_rms_n);
  rms(worst.friction_rms_n, found.friction_rms_n);
  rms(worst.counts_rms, found.counts_rms);
  rms(worst.unled_rms_n, found.unled_rms_n);
  worst.samples += found.samples;
  worst.setting = found.setting;
  worst.reference = found.reference;
  ++total.trials;
}

}  // namespace

void ErrorCheck::patch_follows() {
  if (rig_ == nullptr) return;
  const bool all_seen = fabrics_.size() >= plan_->fabrics.size() &&
                        explorations_.size() >= plan_->explorations.size();
  rig_->record_motion(!all_seen && trials_.size() < most_trials);
}

void ErrorCheck::trial_done(std::size_t trial, bool complete, TimePoint now,
                            const std::vector<TimePoint>& sampled) {
  if (rig_ == nullptr) return;
  auto motion = rig_->extract_motion(now);
  if (!motion || !complete) return;
  const recipes::TrialSpec& spec = plan_->trials[trial];
  const bool new_fabric = fabrics_.insert(spec.fabric).second;
  const bool new_exploration = explorations_.insert(spec.exploration).second;
  if (new_fabric || new_exploration) trials_.push_back({trial, std::move(*motion), sampled});
}

std::vector<SimulationError> ErrorCheck::errors() const {
  std::vector<SimulationError> out;
  for (const StoredTrial& stored : trials_) {
    const auto found = rig_->run_errors(stored.motion, stored.sampled);
    out.resize(found.size());
    for (std::size_t i = 0; i < found.size(); ++i)
      merge(found[i], plan_->fabrics[plan_->trials[stored.trial].fabric], out[i]);
  }
  return out;
}

}  // namespace weft::daemon
