
#include <nlohmann/json.hpp>
#include <set>

#include "classifier/features/feature_matrix.hpp"
#include "daemon/analysis/design/design_page.hpp"

namespace weft::daemon {
namespace {

using nlohmann::ordered_json;
namespace design = classifier::design;

// of each point and draw a training for every repetition left out; docs/design.md says so
constexpr std::size_t reported_points = 5, reported_draws = 1;

Result<DesignParts> sweep_parts(const Dataset& dataset) {
  const auto analyses = analyse_sweep(std::span(&dataset, 1), {});
  if (!analyses) return pass(analyses.error());
  DesignParts out;
  ordered_json list = ordered_json::array();
  for (const SweepAnalysis& one : *analyses) {
    out.html += design_section(one);
    list.push_back(design_json(one));
  }
  out.json = ordered_json{{"sweeps", std::move(list)}}.dump();
  return out;
}

std::size_t repetitions_of(const std::vector<classifier::Trial>& trials) {
  std::set<std::string> groups;
  for (const classifier::Trial& trial : trials) groups.insert(trial.group);
  return groups.size();
}

Result<RepetitionStudy> run_study(const Dataset& dataset, const std::string& exploration,
                                  const std::vector<classifier::Trial>& trials) {
  const auto features = classifier::build_feature_matrix(trials);
  if (!features) return pass(features.error());
  design::CurveOptions options;
  options.draws = reported_draws;
  options.most_points = reported_points;
  auto curve = design::learning_curve(by_repetition(*features, dataset, {}), options);
  if (!curve) return pass(curve.error());
  design::ForecastOptions wanted;
  wanted.predict = 2 * curve->repetitions;
  const auto forecast = design::forecast_repetitions(*curve, wanted);
  if (!forecast) return pass(forecast.error());
  return RepetitionStudy{dataset.info.kind, dataset_sha256(dataset),
                         exploration,       std::string(classifier::to_string(options.learner)),
                         std::move(*curve), *forecast};
}

}  // namespace

DesignParts analyse_design(const Dataset& dataset,
                           const std::function<void(const std::string&)>& progress) {
  if (!dataset.info.factors.empty()) {
    progress("the cells of the sweep");
    auto parts = sweep_parts(dataset);
    if (parts) return std::move(*parts);
    progress("left out: " + to_string(parts.error()));
    return {};
  }
  DesignParts out;
  ordered_json list = ordered_json::array();
  for (const std::string& exploration : list_explorations(dataset)) {
    const auto trials = complete_trials(dataset, exploration);
    if (repetitions_of(trials) < least_reported_repetitions) continue;
    progress("learning curve of " + exploration);
    const auto study = run_study(dataset, exploration, trials);
    if (study) {
      out.html += design_section(*study);
      list.push_back(design_json(*study));
    } else {
      progress("left out: " + to_string(study.error()));
    }
  }
  if (!list.empty()) out.json = ordered_json{{"repetitions", std::move(list)}}.dump();
  return out;
}

}  // namespace weft::daemon
