#include <nlohmann/json.hpp>

#include "daemon/analysis/imprint/tables.hpp"

namespace weft::daemon {

namespace ci = classifier::imprint;
using nlohmann::ordered_json;

namespace {

ordered_json experiment_json(const ci::ExperimentOutcome& outcome) {
  return {{"converged", outcome.converged},
          {"correct", outcome.converged ? ordered_json(outcome.correct) : ordered_json(nullptr)},
          {"total", outcome.converged ? ordered_json(outcome.total) : ordered_json(nullptr)},
          {"rounds", outcome.most_rounds},
          {"wrong", outcome.wrong}};
}

ordered_json printed_json(ci::Experiment experiment, const FeatureSet& set) {
  const auto entry =
      set.sigmas.empty() ? std::nullopt : ellis_entry(experiment, set.sigmas, set.form);
  if (!entry) return nullptr;
  if (!entry->converged) return {{"converged", false}};
  return {{"converged", true}, {"correct", entry->correct}, {"total", ellis_imprints}};
}

}  // namespace

ordered_json tables_json(const ImprintTables& tables) {
  ordered_json sets = ordered_json::array();
  for (const FeatureSet& set : tables.sets) {
    ordered_json one{
        {"scales", set.sigmas},
        {"features", set.sigmas.empty() ? set.name() : std::string(to_string(set.form))},
        {"linearly_separable", to_string(set.separability.verdict)}};
    for (std::size_t e = 0; e < tables.options.experiments.size(); ++e) {
      const ci::Experiment experiment = tables.options.experiments[e];
      ordered_json& row = one["experiments"][std::string(to_string(experiment))];
      row["paper"] = printed_json(experiment, set);
      for (std::size_t r = 0; r < tables.options.rules.size(); ++r)
        row[std::string(to_string(tables.options.rules[r]))] =
            experiment_json(tables.outcome(set, e, r));
    }
    sets.push_back(std::move(one));
  }
  ordered_json requested = ordered_json::object(), left_out = ordered_json::object();
  for (std::size_t e = 0; e < tables.requested.size(); ++e)
    requested[std::string(to_string(tables.options.experiments[e]))] = tables.requested[e];
  for (const auto& [experiment, why] : tables.left_out) left_out[experiment] = why;
  return {{"command", "imprint tables"},     {"bench", to_string(tables.bench)},
          {"dataset", tables.dataset},       {"dataset_sha256", tables.sha256},
          {"imprints", tables.imprints},     {"classes", tables.classes},
          {"objects", tables.objects},       {"asked", std::move(requested)},
          {"left_out", std::move(left_out)}, {"sets", std::move(sets)}};
}

}  // namespace weft::daemon
