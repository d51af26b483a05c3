#include "daemon/service/methods/trial_curves.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>

namespace weft::daemon::api {
namespace {

using nlohmann::json;

constexpr double least_gap_s = 0.15, gap_periods = 5;
constexpr std::size_t most_frames = 300, most_counts = 100'000;  // numbers in one answer

double seconds(std::int64_t t_ns, std::int64_t zero_ns) {
  return static_cast<double>(t_ns - zero_ns) * 1e-9;
}

/// Longer intervals are gaps [ns].
std::int64_t gap_ns(const std::vector<std::int64_t>& t_ns) {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < t_ns.size(); ++i) steps.push_back(t_ns[i] - t_ns[i - 1]);
  if (steps.empty()) return 0;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::ranges::nth_element(steps, middle);
  return std::llround(std::max(least_gap_s * 1e9, gap_periods * static_cast<double>(*middle)));
}

/// Sections of samples without a gap, as first and last index.
std::vector<std::pair<std::size_t, std::size_t>> find_runs(const std::vector<std::int64_t>& t_ns) {
  std::vector<std::pair<std::size_t, std::size_t>> out;
  const std::int64_t longest_ns = gap_ns(t_ns);
  for (std::size_t i = 0; i < t_ns.size(); ++i) {
    if (out.empty() || t_ns[i] - t_ns[i - 1] > longest_ns) out.emplace_back(i, i);
    out.back().second = i;
  }
  return out;
}

std::int64_t first_time(const TrialRecord& record) {
  std::int64_t out = std::numeric_limits<std::int64_t>::max();
  for (const auto* times : {&record.t_ns, &record.wrench.t_ns, &record.stages.t_ns})
    if (!times->empty()) out = std::min(out, times->front());
  return out == std::numeric_limits<std::int64_t>::max() ? 0 : out;
}

json phases_json(const classifier::Trial& trial, const TrialRecord& record, std::int64_t zero_ns) {
  json out = json::array();
  for (std::size_t i = 0; i < trial.phase.size(); ++i) {
    const double t_s = seconds(record.t_ns[i], zero_ns);
    if (i == 0 || trial.phase[i] != trial.phase[i - 1])
      out.push_back({{"phase", std::string(1, to_char(trial.phase[i]))}, {"begin_s", t_s}});
    out.back()["end_s"] = t_s;
  }
  return out;
}

json target_json(const std::optional<ForceTarget>& target) {
  if (!target) return nullptr;
  return {{"phase", std::string(1, to_char(target->phase))},
          {"force_N", target->force_n},
          {"band_N", target->band_n}};
}

json force_json(const WrenchStream& wrench, std::size_t points, std::int64_t zero_ns) {
  if (wrench.samples() == 0) return nullptr;
  std::vector<NamedCurve> curves;
  constexpr const char* names[] = {"fx_N", "fy_N", "fz_N"};
  for (std::size_t axis = 0; axis < std::size(names); ++axis)
    curves.push_back(
        {names[axis], [&wrench, axis](std::size_t i) { return wrench.force_n(i, axis); }});
  return curves_json(wrench.t_ns, points, zero_ns, curves);
}

json stages_json(const StageStream& stages, const std::vector<Axis>& axes, std::size_t points,
                 std::int64_t zero_ns) {
  if (stages.samples() == 0) return nullptr;
  std::vector<NamedCurve> curves;
  for (std::size_t k = 0; k < axes.size(); ++k) {
    const bool rotary = axes[k].rotary;
    const double shown = (rotary ? 180 / std::numbers::pi : 1e3) / axes[k].quanta_per_unit();
    curves.push_back({axes[k].name + (rotary ? "_deg" : "_mm"),
                      [&stages, k, width = axes.size(), shown](std::size_t i) {
                        return stages.quanta[i * width + k] * shown;
                      }});
  }
  return curves_json(stages.t_ns, points, zero_ns, curves);
}

/// Mean of each taxel in a phase [counts]; null if the phase has no frame.
json mean_json(const classifier::Trial& trial, Phase phase) {
  std::vector<double> sum(trial.taxels);
  double frames = 0;
  for (std::size_t i = 0; i < trial.samples(); ++i) {
    if (trial.phase[i] != phase) continue;
    ++frames;
    for (std::size_t k = 0; k < trial.taxels; ++k) sum[k] += trial.row(i)[k];
  }
  if (frames == 0) return nullptr;
  for (double& value : sum) value /= frames;
  return sum;
}

json taxels_json(const classifier::Trial& trial, const TrialRecord& record, std::int64_t zero_ns) {
  if (trial.taxels == 0 || trial.samples() == 0) return nullptr;
  json times = json::array(), frames = json::array();
  const std::size_t most = std::clamp<std::size_t>(most_counts / trial.taxels, 1, most_frames);
  for (const SampleRange& range : reduce_samples(record.t_ns, most)) {
    times.push_back(range.is_gap ? json() : json(seconds(record.t_ns[range.first], zero_ns)));
    const auto row = trial.row(range.first);
    frames.push_back(range.is_gap ? json() : json(std::vector<double>(row.begin(), row.end())));
  }
  return {{"mean_S_counts", mean_json(trial, Phase::rest)},
          {"mean_M_counts", mean_json(trial, Phase::motion)},
          {"t_s", std::move(times)},
          {"counts", std::move(frames)}};
}

}  // namespace

std::vector<SampleRange> reduce_samples(const std::vector<std::int64_t>& t_ns, std::size_t points) {
  if (t_ns.empty() || points == 0) return {};
  auto runs = find_runs(t_ns);
  if (2 * runs.size() > points) runs = {{0, t_ns.size() - 1}};
  // Each section may end with a shorter range, and between sections there is a gap.
  const std::size_t whole = points - 2 * (runs.size() - 1);
  const std::size_t each = (t_ns.size() + whole - 1) / whole;
  std::vector<SampleRange> out;
  for (const auto& [first, last] : runs) {
    if (!out.empty()) out.push_back({first, first, true});
    for (std::size_t i = first; i <= last; i += each)
      out.push_back({i, std::min(i + each - 1, last)});
  }
  return out;
}

json curves_json(const std::vector<std::int64_t>& t_ns, std::size_t points, std::int64_t zero_ns,
                 const std::vector<NamedCurve>& curves) {
  json out;
  for (const SampleRange& point : reduce_samples(t_ns, points)) {
    out["t_s"].push_back(point.is_gap ? json() : json(seconds(t_ns[point.first], zero_ns)));
    for (const NamedCurve& curve : curves) {
      double low = curve.value(point.first), high = low;
      for (std::size_t i = point.first; i <= point.last; ++i) {
        low = std::min(low, curve.value(i));
        high = std::max(high, curve.value(i));
      }
      json& limits = out[curve.name];
      limits["min"].push_back(point.is_gap ? json() : json(low));
      limits["max"].push_back(point.is_gap ? json() : json(high));
    }
  }
  return out;
}

json trial_curves_json(const Dataset& dataset, std::size_t index, std::size_t points,
                       const std::vector<ForceTarget>& targets) {
  const classifier::Trial& trial = dataset.trials[index];
  const TrialRecord& record = dataset.records[index];
  const std::int64_t zero_ns = first_time(record);
  return {{"trial", trial.file},
          {"bench", to_string(dataset.info.kind)},
          {"label", record.spec.label},
          {"exploration", record.spec.exploration},
          {"repetition", record.spec.repetition},
          {"attempt", record.spec.attempt},
          {"outcome", to_string(record.outcome)},
          {"begin_s", seconds(zero_ns, 0)},
          {"phases", phases_json(trial, record, zero_ns)},
          {"target", target_json(find_target(targets, record.spec.exploration))},
          {"force", force_json(record.wrench, points, zero_ns)},
          {"stages", stages_json(record.stages, dataset.info.axes, points, zero_ns)},
          {"taxels", taxels_json(trial, record, zero_ns)}};
}

}  // namespace weft::daemon::api
