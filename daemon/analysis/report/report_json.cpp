#include <nlohmann/json.hpp>

#include "daemon/analysis/report/core_rows.hpp"
#include "daemon/analysis/report/force_quality.hpp"
#include "daemon/analysis/report/json_parts.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/base/file/atomic_file.hpp"

namespace weft::daemon {
namespace {

using nlohmann::ordered_json;

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

ordered_json cores_json(const std::vector<ExplorationResult>& results) {
  ordered_json out = ordered_json::array();
  for (const ExplorationResult& result : results) {
    const auto* e = result.find(classifier::Reduction::pvalue);
    if (e == nullptr) continue;
    for (const CoreLine& line : core_lines(e->model)) {
      ordered_json core = core_json(line);
      core["exploration"] = result.exploration;
      out.push_back(std::move(core));
    }
  }
  return out;
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

void add_provenance(const ReportInput& input, ordered_json& out) {
  const DatasetInfo& info = input.dataset.info;
  out["level"] = input.run.level;
  out["seed"] = info.seed;
  out["ended_early"] = ended_early_json(info);
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
  out.update(run_json(input.run));
  out["force_by_fabric"] = force_json(input.dataset);
  out["results"] = ordered_json::object();
  for (const ExplorationResult& result : input.results)
    out["results"][result.exploration] = result_json(result);
  out["cores"] = cores_json(input.results);
  out["design"] =
      input.design.json.empty() ? ordered_json() : ordered_json::parse(input.design.json);
  if (input.verified != nullptr)  // nobody counted these, or looked at the rig
    for (const char* const unknown :
         {"cleanup", "rig", "forecast_s", "wall_s", "realtime_factor", "time_shares"})
      out[unknown] = nullptr;
  add_provenance(input, out);
  return out.dump(1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

bool is_report_json(std::string_view text) {
  const ordered_json document = ordered_json::parse(text, nullptr, false);
  const auto has = [&](const char* key) { return document.contains(key); };
  return has("bench") && has("dataset_sha256") && has("results") && has("cores") && has("machine");
}

Status write_report_json(const ReportInput& input, const std::filesystem::path& path) {
  if (Status ok = check(input); !ok) return ok;
  return write_text_file(path, report_json(input));
}

}  // namespace weft::daemon
