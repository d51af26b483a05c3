#include "daemon/analysis/report/trace.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "recipes/engine/plan.hpp"

namespace weft::daemon {
namespace {

constexpr double pause_s = 0.15;  // more than five taxel periods without a record

double seconds(std::int64_t t_ns, std::int64_t origin_ns) {
  return static_cast<double>(t_ns - origin_ns) * 1e-9;
}

std::vector<PhaseSpan> find_spans(const classifier::Trial& trial, const TrialRecord& record) {
  std::vector<PhaseSpan> spans;
  for (std::size_t i = 0; i < trial.samples(); ++i) {
    const double t = seconds(record.t_ns[i], record.t_ns.front());
    if (spans.empty() || spans.back().phase != trial.phase[i])
      spans.push_back({trial.phase[i], t, t});
    spans.back().end_s = t;
  }
  // Adjacent spans meet half way, unless there is a pause between them.
  for (std::size_t k = 1; k < spans.size(); ++k) {
    const double gap_s = spans[k].begin_s - spans[k - 1].end_s;
    if (gap_s < pause_s) spans[k - 1].end_s = spans[k].begin_s = spans[k].begin_s - gap_s / 2;
  }
  return spans;
}

double rest_level(const classifier::Trial& trial, std::size_t pad) {
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < trial.samples(); ++i) {
    if (trial.phase[i] != Phase::rest) continue;
    sum += trial.row(i)[pad];
    ++count;
  }
  return count > 0 ? sum / static_cast<double>(count) : trial.row(0)[pad];
}

Curve pad_curve(const classifier::Trial& trial, const TrialRecord& record, std::size_t pad) {
  Curve out;
  const double level = rest_level(trial, pad);
  for (std::size_t i = 0; i < trial.samples(); ++i) {
    out.t_s.push_back(seconds(record.t_ns[i], record.t_ns.front()));
    out.value.push_back(trial.row(i)[pad] - level);
  }
  return out;
}

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

std::optional<std::size_t> typical_trial(const Dataset& dataset, std::string_view exploration) {
  std::vector<std::size_t> candidates;
  for (std::size_t i = 0; i < dataset.records.size(); ++i) {
    const TrialRecord& record = dataset.records[i];
    if (record.outcome == TrialOutcome::complete && record.spec.exploration == exploration &&
        dataset.trials[i].samples() > 0)
      candidates.push_back(i);
  }
  if (candidates.empty()) return std::nullopt;
  const auto with_force =
      std::stable_partition(candidates.begin(), candidates.end(), [&](std::size_t i) {
        return dataset.records[i].quality.force_rms_error_n.has_value() &&
               dataset.records[i].wrench.samples() > 0;
      });
  if (with_force == candidates.begin()) return candidates.front();
  std::stable_sort(candidates.begin(), with_force, [&](std::size_t a, std::size_t b) {
    return *dataset.records[a].quality.force_rms_error_n <
           *dataset.records[b].quality.force_rms_error_n;
  });
  return candidates[static_cast<std::size_t>(with_force - candidates.begin() - 1) / 2];
}

TrialTrace extract_trace(const Dataset& dataset, std::size_t trial_index) {
  const classifier::Trial& trial = dataset.trials[trial_index];
  const TrialRecord& record = dataset.records[trial_index];
  TrialTrace out;
  out.record = &record;
  if (trial.samples() == 0) return out;
  out.phases = find_spans(trial, record);
  for (std::size_t i = 0; i < record.wrench.samples(); ++i) {
    const double t = seconds(record.wrench.t_ns[i], record.t_ns.front());
    out.normal_n.t_s.push_back(t);
    out.normal_n.value.push_back(record.wrench.force_n(i, 2));
    out.tangential_n.t_s.push_back(t);
    out.tangential_n.value.push_back(
        std::hypot(record.wrench.force_n(i, 0), record.wrench.force_n(i, 1)));
  }
  for (std::size_t pad = 0; pad < trial.taxels; ++pad)
    out.pads.push_back(pad_curve(trial, record, pad));
  return out;
}

std::vector<TracePoint> thinned(const Curve& curve, std::size_t buckets) {
  std::vector<TracePoint> out;
  if (curve.t_s.empty() || buckets == 0) return out;
  const double origin_s = curve.t_s.front();
  const double width_s =
      std::max((curve.t_s.back() - origin_s) / static_cast<double>(buckets), 1e-9);
  const auto bucket_of = [&](std::size_t i) {
    return std::floor((curve.t_s[i] - origin_s) / width_s);
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t begin = 0, end = 0; begin < curve.t_s.size(); begin = end) {
    std::size_t low = begin, high = begin;
    const bool paused = begin > 0 && curve.t_s[begin] - curve.t_s[begin - 1] > pause_s;
    for (end = begin; end < curve.t_s.size() && bucket_of(end) <= bucket_of(begin); ++end) {
      if (end > begin && curve.t_s[end] - curve.t_s[end - 1] > pause_s) break;
      if (curve.value[end] < curve.value[low]) low = end;
      if (curve.value[end] > curve.value[high]) high = end;
    }
    if (paused) out.push_back({nan, nan});
    const auto [first, second] = std::minmax(low, high);
    out.push_back({curve.t_s[first], curve.value[first]});
    if (second != first) out.push_back({curve.t_s[second], curve.value[second]});
  }
  return out;
}

std::vector<ForceTarget> force_targets(const DatasetInfo& info) {
  std::vector<ForceTarget> out;
  if (info.recipe_json.empty() || info.rig_json.empty()) return out;
  const auto limits = recipes::parse_rig_limits(info.rig_json);
  if (!limits || !limits->has_wrench) return out;
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

double in_band_share(const ForceTally& tally) {
  return tally.samples == 0
             ? 0
             : static_cast<double>(tally.in_band) / static_cast<double>(tally.samples);
}

namespace {

/// Keeps, for each phase, the mean that is further from the weight.
void keep_worst(const std::optional<RestForces>& rest, std::optional<RestForces>& worst) {
  if (!rest) return;
  if (!worst) worst = rest;
  const auto keep = [&](double RestForces::*phase) {
    const double now_n = (*rest).*phase;
    double& kept_n = (*worst).*phase;
    const double off_n = std::abs(now_n - rest->weight_n);
    if (std::isnan(kept_n) || off_n > std::abs(kept_n - rest->weight_n)) kept_n = now_n;
  };
  keep(&RestForces::before_n);
  keep(&RestForces::after_n);
}

}  // namespace

std::vector<FabricForce> force_by_fabric(const Dataset& dataset,
                                         const std::vector<ForceTarget>& targets) {
  std::vector<FabricForce> out;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    const TrialRecord& record = dataset.records[i];
    const auto target = find_target(targets, record.spec.exploration);
    if (record.outcome != TrialOutcome::complete || !target) continue;
    FabricForce& fabric = entry(out, record.spec.label);
    ++fabric.trials;
    keep_worst(record.quality.rest, fabric.rest);
    add_trial(dataset.trials[i], record, *target, fabric.tally);
  }
  return out;
}

}  // namespace weft::daemon
