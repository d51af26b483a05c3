#include "daemon/analysis/report/report.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

#include "daemon/analysis/report/paper.hpp"
#include "daemon/analysis/report/trace.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/campaign/promise_text.hpp"
#include "recipes/engine/engine.hpp"

namespace weft::daemon {
namespace {

using nlohmann::ordered_json;

/// null if not measured, as in a run that only recorded the end of an earlier one.
ordered_json known(bool is_known, double value) {
  return is_known ? ordered_json(value) : ordered_json(nullptr);
}

ordered_json known(const std::optional<Error>& error) {
  return error ? ordered_json(to_string(*error)) : ordered_json(nullptr);
}

ordered_json tally_json(const ForceTally& tally) {
  const bool any = tally.samples > 0;
  return {{"samples", tally.samples},
          {"rms_error_n", known(any, tally.rms_n())},
          {"worst_error_n", known(any, tally.worst_n)},
          {"in_band_fraction", known(any, in_band_share(tally))}};
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

ordered_json time_json(const WallTimeBreakdown& time) {
  return {{"plant_and_emulators_s", time.plant_and_emulators_s},
          {"drivers_and_control_s", time.drivers_and_control_s},
          {"recorder_s", time.recorder_s},
          {"export_s", time.export_s},
          {"error_check_s", time.error_check_s}};
}

std::string mn(double newtons) {
  return significant(newtons * 1e3) + " mN";
}

std::string against(const SimulationError& error) {
  return "error against " + error.worst.reference + ": max " + mn(error.worst.force_max_n) +
         ", rms " + mn(error.worst.force_rms_n);
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
  out["confounded"] = result.confounded ? ordered_json("mounting") : ordered_json(nullptr);
  for (const ReductionResult& r : result.level_removed)
    out["level_removed"][std::string(classifier::to_string(r.reduction))] =
        accuracy_json(r.evaluation);
  if (!result.best) return out;
  out["best"] = accuracy_json(result.best->scores);
  out["best"]["permuted_accuracy"] = result.best->permuted_accuracy;
  return out;
}

ordered_json cores_json(const std::vector<ExplorationResult>& results) {
  ordered_json out = ordered_json::array();
  for (const ExplorationResult& result : results) {
    const auto* e = result.find(classifier::Reduction::pvalue);
    if (e == nullptr) continue;
    for (const CoreLine& line : core_lines(*e->trained.cores())) {
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
    if (f.rest)
      row["rest"] = {{"weight_n", f.rest->weight_n},
                     {"worst_before_n", f.rest->before_n},
                     {"worst_after_n", f.rest->after_n}};
    out.push_back(std::move(row));
  }
  return out;
}

ordered_json beside_json(const std::vector<CampaignBeside>& beside) {
  ordered_json out = ordered_json::array();
  for (const CampaignBeside& one : beside) {
    ordered_json results = ordered_json::object();
    for (const ExplorationResult& result : one.results)
      results[result.exploration] = result_json(result);
    out.push_back({{"name", one.name},
                   {"asks_about", to_string(one.repeated)},
                   {"trials", one.trials},
                   {"results", std::move(results)}});
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

ordered_json accuracy_json(const classifier::Scores& e) {
  return {{"accuracy", e.accuracy},
          {"ci95", {e.ci95.low, e.ci95.high}},
          {"ci95_method", e.ci95.method},
          {"deviation", e.deviation},
          {"splits", e.splits.size()}};
}

ordered_json evaluation_json(const classifier::Scores& e) {
  ordered_json accuracies = ordered_json::array();
  for (const classifier::SplitOutcome& split : e.splits) accuracies.push_back(split.accuracy);
  ordered_json out = accuracy_json(e);
  out["accuracy_of_splits"] = std::move(accuracies);
  out["balanced_accuracy"] = e.confusion.balanced_accuracy();
  out["confusion"] = confusion_json(e.confusion);
  out["train_s"] = e.train_s;
  out["test_s_per_sample"] = e.test_s_per_sample;
  return out;
}

ordered_json core_json(const CoreLine& line) {
  ordered_json features = ordered_json::array();
  for (const CoreFeature& f : line.features)
    features.push_back(
        {{"name", f.name}, {"p_value", f.p_value}, {"log10_p", f.log_p / std::log(10.0)}});
  return {{"pair", {line.a, line.b}},
          {"features", std::move(features)},
          {"delta", line.info->threshold},
          {"C", line.info->c},
          {"gamma", line.info->gamma},
          {"cv_errors", line.info->cv_errors},
          {"train_rows", line.info->train_rows},
          {"support_vectors", line.support_vectors}};
}

ordered_json ended_early_json(const DatasetInfo& info) {
  ordered_json out = ordered_json::array();
  for (const EndedEarly& some : info.ended_early)
    out.push_back(
        {{"label", some.label}, {"exploration", some.exploration}, {"trials", some.trials}});
  return out;
}

nlohmann::json envelope_json(const recipes::Forecast& forecast) {
  nlohmann::json axes;
  for (const recipes::Axis axis : recipes::all_axes) {
    const std::size_t k = recipes::index(axis);
    if (forecast.fixed[k]) continue;
    const std::string unit = recipes::is_linear(axis) ? "_m" : "_rad";
    axes[std::string(recipes::to_string(axis))] = {{"min" + unit, forecast.envelope[k].min},
                                                   {"max" + unit, forecast.envelope[k].max},
                                                   {"margin" + unit, forecast.margin[k]}};
  }
  return axes;
}

double realtime_factor(const CampaignSummary& run) {
  return run.wall_s > 0 ? run.virtual_s / run.wall_s : 0;
}

ordered_json run_json(const CampaignSummary& run) {
  ordered_json out;
  out["name"] = run.name;
  out["outcome"] = recipes::to_string(run.outcome);
  out["cleanup"] = recipes::to_string(run.cleanup);
  out["rig"] = recipes::to_string(run.rig);
  out["error"] = known(run.error);
  out["dataset_error"] = known(run.dataset_error);
  out["trials_planned"] = run.trials_planned;
  out["trials_complete"] = run.trials_complete;
  out["trials_ended_early"] = run.trials_ended_early;
  out["takes_rejected"] = run.attempts_rejected;
  out["complete"] = is_complete(run);
  out["forecast_s"] = run.forecast_s;
  out["virtual_s"] = known(run.virtual_s > 0, run.virtual_s);
  out["wall_s"] = run.wall_s;
  out["realtime_factor"] = known(run.virtual_s > 0, realtime_factor(run));
  out["time_shares"] = time_json(run.time);
  out["dataset_sha256"] = run.dataset_sha256;
  out["force_rms_error_n"] = known(run.force.samples > 0, run.force.rms_n());
  out["force"] = tally_json(run.force);
  if (!run.simulation.empty()) {
    out["simulation"] = ordered_json::parse(to_json(run.simulation));
    out["simulation"]["sentence"] = sentence(run.simulation);
    if (const auto lines = promise_lines(run.simulation); !lines.empty())
      out["simulation"]["kept"] = lines;
  }
  return out;
}

std::string sentence(const SimulationNote& note) {
  if (note.empty()) return {};
  std::string out = "Simulated at level " + note.setting + " because " + note.because;
  if (!note.errors.empty()) out += "; " + against(note.errors.back());
  return out;
}

std::vector<std::string> promise_lines(const SimulationNote& note) {
  std::vector<std::string> lines;
  for (std::string line : {format_promise(note), format_budget(note), format_aside(note)})
    if (!line.empty()) lines.push_back(std::move(line));
  return lines;
}

std::vector<std::string> error_lines(const SimulationNote& note) {
  std::vector<std::string> lines;
  for (const SimulationError& error : note.errors) {
    const sim::RunError& e = error.worst;
    const std::string unsure =
        e.is_doubled ? "; two references differ by at most " + mn(e.uncertainty_n) : std::string();
    const std::string pads = e.pads ? "; taxels max " + fixed(e.counts_max, 0) + ", rms " +
                                          significant(e.counts_rms) + " counts"
                                    : "";
    lines.push_back(against(error) + unsure + pads + " (" + std::to_string(error.trials) +
                    (error.trials == 1 ? " trial" : " trials") + " replayed, worst on " +
                    error.worst_fabric + "). Touch-down and ramps (not recorded): max " +
                    mn(e.anywhere_max_n) + "; without a force loop rms " + mn(e.unled_rms_n));
  }
  return lines;
}

std::string simulation_text(const SimulationNote& note) {
  if (note.empty()) return {};
  std::string out;
  for (const std::string& line : promise_lines(note)) out += wrapped(line, "  ");
  out += wrapped(sentence(note), "  ");
  for (const std::string& line : error_lines(note)) out += wrapped(line, "    ");
  return out;
}

bool has_learning_curve(const ReportInput& input) {
  return !input.design.json.empty() && input.dataset.info.factors.empty();
}

ordered_json report_record(const ReportInput& input) {
  ordered_json out;
  out["bench"] = to_string(input.dataset.info.kind);
  out.update(run_json(input.run));
  out["force_by_fabric"] = force_json(input.dataset);
  out["headline"] = ordered_json::array();
  for (const Headline& headline : input.headlines)
    out["headline"].push_back(headline_json(headline));
  out["other_protocols"] = ordered_json::array();
  for (const OtherProtocol& other :
       other_protocols(!input.results.empty(), has_learning_curve(input)))
    out["other_protocols"].push_back({{"key", other.name}, {"why", other.text}});
  out["results"] = ordered_json::object();
  for (const ExplorationResult& result : input.results)
    out["results"][result.exploration] = result_json(result);
  if (input.beside != nullptr) out["beside"] = beside_json(*input.beside);
  out["audit"] = headlines_json(input.audit, input.dataset.info.kind);
  out["cores"] = cores_json(input.results);
  out["design"] =
      input.design.json.empty() ? ordered_json() : ordered_json::parse(input.design.json);
  if (input.verified != nullptr)  // not measured, and the rig was not checked
    for (const char* const unknown :
         {"cleanup", "rig", "forecast_s", "wall_s", "realtime_factor", "time_shares"})
      out[unknown] = nullptr;
  add_provenance(input, out);
  return out;
}

bool is_report_json(std::string_view text) {
  const ordered_json document = ordered_json::parse(text, nullptr, false);
  const auto has = [&](const char* key) { return document.contains(key); };
  return has("bench") && has("dataset_sha256") && has("results") && has("cores") && has("machine");
}

}  // namespace weft::daemon
