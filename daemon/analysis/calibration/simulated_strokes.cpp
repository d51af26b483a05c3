#include "daemon/analysis/calibration/simulated_strokes.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

#include "daemon/analysis/calibration/bootstrap.hpp"
#include "daemon/analysis/calibration/stroke_choice.hpp"
#include "daemon/analysis/calibration/write_fabrics.hpp"

namespace weft::daemon::calibration {
namespace {

std::set<std::string> labels_of(const RecordingView& view) {
  std::set<std::string> out;
  for (const Stroke& stroke : view.strokes) out.insert(stroke.cloth);
  return out;
}

void fill_trial(const Stroke& stroke, classifier::Trial& trial, TrialRecord& record) {
  trial.taxels = stroke.counts.size();
  trial.phase.assign(stroke.samples(), Phase::motion);
  for (std::size_t i = 0; i < stroke.samples(); ++i) {
    for (const std::vector<double>& counts : stroke.counts)
      trial.counts.push_back(std::round(counts[i]) + 0.0);  // avoids -0
    record.t_ns.push_back(std::llround(static_cast<double>(i) * 1e9 / stroke.rate_hz));
  }
}

DatasetInfo stroke_info(const DatasetInfo& recorded, BenchKind kind) {
  DatasetInfo out;
  out.kind = kind;
  out.name = recorded.name;
  out.source = recorded.source;  // determines how names and repetitions are interpreted
  out.taxel_rate_hz = recorded.taxel_rate_hz;
  out.factors = recorded.factors;
  out.group_columns = recorded.group_columns;
  return out;
}

void name_side(Dataset& set, const std::string& side) {
  for (std::size_t i = 0; i < set.trials.size(); ++i) {
    set.trials[i].file = side + "-" + set.trials[i].file;
    set.trials[i].group = set.records[i].spec.group = side + "-" + set.trials[i].group;
  }
}

/// The statistics of one set of strokes, recorded and simulated.
void add_sides(const StatisticSet& recorded, const RecordingView& simulated,
               const std::string& strokes_of, std::vector<SidedStatistic>& out) {
  const StatisticSet made = compute_statistics(simulated);
  for (const Statistic& one : recorded.statistics) {
    const Statistic* other = find(made.statistics, one.name, one.cloth);
    out.push_back(
        {one, strokes_of, {}, other ? std::optional(other->value) : std::optional<double>()});
  }
}

}  // namespace

sim::FabricLibrary with_own_cloths(sim::FabricLibrary library, const RecordingView& view,
                                   const std::string& prefix) {
  for (const std::string& label : labels_of(view)) {
    const sim::Fabric* own = library.find(name_in_table(prefix, label));
    if (own == nullptr) continue;
    sim::Fabric cloth = *own;
    cloth.name = label;
    library.fabrics.insert(library.fabrics.begin(), std::move(cloth));
  }
  return library;
}

Dataset stroke_dataset(const Dataset& recorded, const RecordingView& view, BenchKind kind) {
  Dataset out;
  out.info = stroke_info(recorded.info, kind);
  for (std::size_t i = 0; i < recorded.trials.size(); ++i) {
    if (recorded.records[i].outcome != TrialOutcome::complete) continue;
    classifier::Trial& trial = out.trials.emplace_back();
    TrialRecord& record = out.records.emplace_back();
    trial.file = recorded.trials[i].file;
    trial.label = recorded.trials[i].label;
    trial.group = recorded.trials[i].group;
    record.spec = recorded.records[i].spec;
    record.spec.patch_seed = 0;
    fill_trial(view.strokes[out.trials.size() - 1], trial, record);
  }
  return out;
}

Dataset both_sides(Dataset recorded, Dataset simulated) {
  name_side(recorded, "recorded");
  name_side(simulated, "simulated");
  std::map<std::string, std::uint32_t> mountings;
  for (std::size_t i = 0; i < recorded.trials.size(); ++i) {
    std::uint32_t& most = mountings[recorded.trials[i].label];
    most = std::max(most, recorded.records[i].spec.place.mounting);
  }
  for (std::size_t i = 0; i < simulated.trials.size(); ++i) {
    std::uint32_t& mounting = simulated.records[i].spec.place.mounting;
    if (mounting > 0) mounting += mountings[simulated.trials[i].label];
  }
  recorded.info.kind = BenchKind::unknown;
  recorded.info.name += ", recorded and SIMULATED";
  std::ranges::move(simulated.trials, std::back_inserter(recorded.trials));
  std::ranges::move(simulated.records, std::back_inserter(recorded.records));
  return recorded;
}

std::vector<SidedStatistic> compare_strokes(const RecordingView& recorded,
                                            const RecordingView& simulated, std::size_t draws,
                                            std::uint64_t seed) {
  const BootstrapSet all = bootstrap_statistics(recorded, draws, seed);
  StatisticSet set;
  for (const BootstrapStatistic& one : all.statistics) set.statistics.push_back(one.statistic);
  std::vector<SidedStatistic> out;
  add_sides(set, simulated, {}, out);
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i].interval = std::pair(all.statistics[i].low, all.statistics[i].high);
  for (const std::string& label : labels_of(recorded))
    add_sides(compute_statistics(strokes_of(recorded, label)), strokes_of(simulated, label), label,
              out);
  return out;
}

}  // namespace weft::daemon::calibration
