#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/dataset/atomic_file.hpp"
#include "daemon/report/core_rows.hpp"
#include "daemon/report/force_quality.hpp"
#include "daemon/report/report.hpp"
#include "recipes/engine/engine.hpp"

namespace weft::daemon {
namespace {

using nlohmann::ordered_json;

double ratio(double part, double whole) {
  return whole > 0 ? part / whole : 0;
}

ordered_json confusion_json(const classifier::Confusion& confusion) {
  ordered_json rows = ordered_json::array();
  for (std::size_t t = 0; t < confusion.classes(); ++t) {
    ordered_json row = ordered_json::array();
    for (std::size_t p = 0; p < confusion.classes(); ++p) row.push_back(confusion.at(t, p));
    rows.push_back(std::move(row));
  }
  return {{"labels", confusion.labels}, {"count", std::move(rows)}};
}

ordered_json evaluation_json(const classifier::Evaluation& e) {
  return {{"accuracy", e.accuracy},       {"ci95", {e.ci95.low, e.ci95.high}},
          {"ci95_method", e.ci95.method}, {"deviation", e.deviation},
          {"splits", e.splits.size()},    {"confusion", confusion_json(e.confusion)},
          {"train_s", e.train_s},         {"test_s_per_sample", e.test_s_per_sample}};
}

ordered_json result_json(const ExplorationResult& result) {
  ordered_json out;
  for (const ReductionResult& r : result.reductions)
    out[std::string(classifier::to_string(r.reduction))] = evaluation_json(r.evaluation);
  out["trials"] = result.trials;
  out["features"] = result.features;
  out["train_threads"] = result.threads;
  out["feature_s_per_sample"] = result.feature_s_per_sample;
  out["permuted_accuracy"] = result.permuted_accuracy;
  return out;
}

ordered_json core_json(const std::string& exploration, const CoreLine& line) {
  ordered_json features = ordered_json::array();
  for (const CoreFeature& f : line.features)
    features.push_back(
        {{"name", f.name}, {"p_value", f.p_value}, {"log10_p", f.log_p / std::log(10.0)}});
  return {{"pair", {line.a, line.b}},
          {"exploration", exploration},
          {"features", std::move(features)},
          {"delta", line.info->threshold},
          {"C", line.info->c},
          {"gamma", line.info->gamma},
          {"cv_errors", line.info->cv_errors},
          {"train_rows", line.info->train_rows},
          {"support_vectors", line.support_vectors}};
}

ordered_json cores_json(const std::vector<ExplorationResult>& results) {
  ordered_json out = ordered_json::array();
  for (const ExplorationResult& result : results) {
    const auto* e = result.find(classifier::Reduction::pvalue);
    if (e == nullptr) continue;
    for (const CoreLine& line : core_lines(e->model))
      out.push_back(core_json(result.exploration, line));
  }
  return out;
}

ordered_json tally_json(const ForceTally& tally) {
  return {{"samples", tally.samples},
          {"rms_error_n", tally.rms_n()},
          {"worst_error_n", tally.worst_n},
          {"in_band_fraction",
           ratio(static_cast<double>(tally.in_band), static_cast<double>(tally.samples))}};
}

ordered_json force_json(const Dataset& dataset) {
  ordered_json out = ordered_json::array();
  for (const FabricForce& f : force_by_fabric(dataset, force_targets(dataset.info))) {
    ordered_json row = {{"fabric", f.fabric}, {"trials", f.trials}};
    row.update(tally_json(f.tally));
    out.push_back(std::move(row));
  }
  return out;
}

ordered_json time_json(const CampaignSummary& run) {
  return {{"plant_and_emulators_s", run.time.plant_and_emulators_s},
          {"drivers_and_control_s", run.time.drivers_and_control_s},
          {"recorder_s", run.time.recorder_s},
          {"export_s", run.time.export_s}};
}

void add_run(const CampaignSummary& run, ordered_json& out) {
  out["name"] = run.name;
  out["outcome"] = recipes::to_string(run.outcome);
  out["cleanup"] = recipes::to_string(run.cleanup);
  out["rig"] = recipes::to_string(run.rig);
  out["error"] = run.error ? ordered_json(to_string(*run.error)) : ordered_json(nullptr);
  out["trials_planned"] = run.trials_planned;
  out["trials_complete"] = run.trials_complete;
  out["forecast_s"] = run.forecast_s;
  out["virtual_s"] = run.virtual_s;
  out["wall_s"] = run.wall_s;
  out["realtime_factor"] = ratio(run.virtual_s, run.wall_s);
  out["time_shares"] = time_json(run);
  out["dataset_sha256"] = run.dataset_sha256;
  out["force_rms_error_n"] = run.force.rms_n();
  out["force"] = tally_json(run.force);
}

void add_provenance(const ReportInput& input, ordered_json& out) {
  const DatasetInfo& info = input.dataset.info;
  out["level"] = input.run.level;
  out["seed"] = info.seed;
  out["recipe_sha256"] = info.recipe_sha256;
  out["rig_sha256"] = info.rig_sha256;
  out["software_version"] = info.software_version;
  out["commit"] = input.commit;
  out["machine"] = input.machine;
}

}  // namespace

// Text of unknown origin may hold bytes that are not UTF-8: they become U+FFFD. NaN becomes null.
std::string report_json(const ReportInput& input) {
  ordered_json out;
  out["bench"] = to_string(input.dataset.info.kind);
  add_run(input.run, out);
  out["force_by_fabric"] = force_json(input.dataset);
  out["results"] = ordered_json::object();
  for (const ExplorationResult& result : input.results)
    out["results"][result.exploration] = result_json(result);
  out["cores"] = cores_json(input.results);
  add_provenance(input, out);
  return out.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

Status write_report_json(const ReportInput& input, const std::filesystem::path& path) {
  if (Status ok = check(input); !ok) return ok;
  return write_text_file(path, report_json(input));
}

}  // namespace weft::daemon
