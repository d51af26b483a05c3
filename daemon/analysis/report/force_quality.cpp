#include "daemon/analysis/report/force_quality.hpp"

#include <algorithm>

#include "recipes/engine/plan.hpp"

namespace weft::daemon {
namespace {

struct Interval {
  std::int64_t first_ns = 0;
  std::int64_t last_ns = -1;
};

Interval time_of(Phase phase, const classifier::Trial& trial, const TrialRecord& record) {
  Interval out;
  bool found = false;
  for (std::size_t i = 0; i < trial.samples(); ++i) {
    if (trial.phase[i] != phase) continue;
    if (!found) out.first_ns = record.t_ns[i];
    out.last_ns = record.t_ns[i];
    found = true;
  }
  return out;
}

void add_trial(const classifier::Trial& trial, const TrialRecord& record, const ForceTarget& target,
               ForceTally& tally) {
  const Interval held = time_of(target.phase, trial, record);
  const auto& times = record.wrench.t_ns;
  const auto first = std::lower_bound(times.begin(), times.end(), held.first_ns) - times.begin();
  const auto last = std::upper_bound(times.begin(), times.end(), held.last_ns) - times.begin();
  for (auto i = first; i < last; ++i)
    tally.add(record.wrench.force_n(static_cast<std::size_t>(i), 2) - target.force_n,
              target.band_n);
}

FabricForce& entry(std::vector<FabricForce>& fabrics, const std::string& name) {
  const auto found = std::find_if(fabrics.begin(), fabrics.end(),
                                  [&](const FabricForce& f) { return f.fabric == name; });
  if (found != fabrics.end()) return *found;
  fabrics.push_back({name, 0, {}});
  return fabrics.back();
}

}  // namespace

std::vector<ForceTarget> force_targets(const DatasetInfo& info) {
  std::vector<ForceTarget> out;
  if (info.recipe_json.empty() || info.rig_json.empty()) return out;
  const auto limits = recipes::parse_rig_limits(info.rig_json);
  if (!limits) return out;
  const recipes::CheckReport report = recipes::check_recipe(info.recipe_json, *limits);
  if (!report.plan) return out;
  for (const recipes::Exploration& exploration : report.plan->explorations) {
    const Phase held = exploration.held_phase();
    const recipes::PhaseStep& step = exploration.step(held);
    out.push_back({exploration.name, step.force_n, step.force_band_n, held});
  }
  return out;
}

std::optional<ForceTarget> find_target(const std::vector<ForceTarget>& targets,
                                       std::string_view exploration) {
  for (const ForceTarget& target : targets)
    if (target.exploration == exploration) return target;
  return std::nullopt;
}

std::vector<FabricForce> force_by_fabric(const Dataset& dataset,
                                         const std::vector<ForceTarget>& targets) {
  std::vector<FabricForce> out;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    const TrialRecord& record = dataset.records[i];
    const auto target = find_target(targets, record.spec.exploration);
    if (record.outcome != TrialOutcome::complete || !target) continue;
    FabricForce& fabric = entry(out, record.spec.label);
    ++fabric.trials;
    add_trial(dataset.trials[i], record, *target, fabric.tally);
  }
  return out;
}

}  // namespace weft::daemon
