#include "daemon/imprint/imprint_dataset.hpp"

#include <algorithm>
#include <map>

#include "daemon/dataset/trial_csv.hpp"

namespace weft::daemon {

using classifier::imprint::Image;
using classifier::imprint::Imprint;

bool holds_imprints(const Dataset& dataset) {
  return !dataset.records.empty() && std::ranges::all_of(dataset.records, [](const auto& record) {
    return record.spec.exploration == imprint_exploration;
  });
}

Status append_imprint(Dataset& dataset, const Image& image, std::string file, std::string label,
                      std::string group) {
  classifier::Trial trial;
  trial.file = std::move(file);
  trial.label = std::move(label);
  trial.group = std::move(group);
  trial.taxels = image.cols();
  trial.counts.assign(image.data().begin(), image.data().end());
  trial.phase.assign(image.rows(), Phase::motion);
  TrialRecord record;
  record.spec.exploration = imprint_exploration;
  record.t_ns.assign(image.rows(), 0);
  return append(dataset, std::move(trial), std::move(record));
}

Result<std::vector<Imprint>> imprints_of(const Dataset& dataset) {
  if (!holds_imprints(dataset))
    return fail(Errc::invalid_argument, "the data set does not hold imprints alone", {},
                "trials of exploration imprint", dataset.info.source, "weft dataset import --help");
  std::map<std::string, std::string> label_of;  // of a group; empty where there are several
  for (const classifier::Trial& trial : dataset.trials) {
    const auto [at, first] = label_of.emplace(trial.group, trial.label);
    if (!first && at->second != trial.label) at->second.clear();
  }
  const bool objects = std::ranges::none_of(
      label_of, [](const auto& entry) { return entry.first.empty() || entry.second.empty(); });
  std::vector<Imprint> out;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i) {
    const classifier::Trial& trial = dataset.trials[i];
    if (dataset.records[i].outcome != TrialOutcome::complete) continue;
    Imprint one{Image(trial.samples(), trial.taxels), trial.file, trial.label,
                objects ? trial.group : trial.file};
    std::ranges::copy(trial.counts, one.image.data().begin());
    out.push_back(std::move(one));
  }
  return out;
}

}  // namespace weft::daemon
