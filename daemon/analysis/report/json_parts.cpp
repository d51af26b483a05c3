#include "daemon/analysis/report/json_parts.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "daemon/analysis/report/report.hpp"
#include "daemon/base/text/format.hpp"
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

ordered_json time_json(const WallTimeBreakdown& time) {
  return {{"plant_and_emulators_s", time.plant_and_emulators_s},
          {"drivers_and_control_s", time.drivers_and_control_s},
          {"recorder_s", time.recorder_s},
          {"export_s", time.export_s},
          {"error_check_s", time.error_check_s}};
}

std::string text(const char* format, double a, double b) {
  std::array<char, 128> out{};
  std::snprintf(out.data(), out.size(), format, a, b);
  return out.data();
}

std::string against(const SimulationError& error) {
  return "error against " + error.worst.reference +
         text(": max %.3g mN, rms %.3g mN", error.worst.force_max_n * 1e3,
              error.worst.force_rms_n * 1e3);
}

}  // namespace

ordered_json evaluation_json(const classifier::Scores& e) {
  ordered_json accuracies = ordered_json::array();
  for (const classifier::SplitOutcome& split : e.splits) accuracies.push_back(split.accuracy);
  return {{"accuracy", e.accuracy},
          {"ci95", {e.ci95.low, e.ci95.high}},
          {"ci95_method", e.ci95.method},
          {"deviation", e.deviation},
          {"splits", e.splits.size()},
          {"accuracy_of_splits", std::move(accuracies)},
          {"confusion", confusion_json(e.confusion)},
          {"train_s", e.train_s},
          {"test_s_per_sample", e.test_s_per_sample}};
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

/// null where nobody measured it, as in a run that only wrote down the end of another.
ordered_json known(bool is_known, double value) {
  return is_known ? ordered_json(value) : ordered_json(nullptr);
}

ordered_json tally_json(const ForceTally& tally) {
  if (tally.samples == 0)
    return {{"samples", 0},
            {"rms_error_n", nullptr},
            {"worst_error_n", nullptr},
            {"in_band_fraction", nullptr}};
  return {{"samples", tally.samples},
          {"rms_error_n", tally.rms_n()},
          {"worst_error_n", tally.worst_n},
          {"in_band_fraction",
           ratio(static_cast<double>(tally.in_band), static_cast<double>(tally.samples))}};
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
    const std::string unit = recipes::is_linear(axis) ? "_m" : "_rad";
    axes[std::string(recipes::to_string(axis))] = {{"min" + unit, forecast.envelope[k].min},
                                                   {"max" + unit, forecast.envelope[k].max},
                                                   {"margin" + unit, forecast.margin[k]}};
  }
  return axes;
}

ordered_json run_json(const CampaignSummary& run) {
  ordered_json out;
  out["name"] = run.name;
  out["outcome"] = recipes::to_string(run.outcome);
  out["cleanup"] = recipes::to_string(run.cleanup);
  out["rig"] = recipes::to_string(run.rig);
  out["error"] = run.error ? ordered_json(to_string(*run.error)) : ordered_json(nullptr);
  out["dataset_error"] =
      run.dataset_error ? ordered_json(to_string(*run.dataset_error)) : ordered_json(nullptr);
  out["trials_planned"] = run.trials_planned;
  out["trials_complete"] = run.trials_complete;
  out["trials_ended_early"] = run.trials_ended_early;
  out["takes_rejected"] = run.attempts_rejected;
  out["complete"] = is_complete(run);
  out["forecast_s"] = run.forecast_s;
  out["virtual_s"] = known(run.virtual_s > 0, run.virtual_s);
  out["wall_s"] = run.wall_s;
  out["realtime_factor"] = known(run.virtual_s > 0, ratio(run.virtual_s, run.wall_s));
  out["time_shares"] = time_json(run.time);
  out["dataset_sha256"] = run.dataset_sha256;
  out["force_rms_error_n"] = known(run.force.samples > 0, run.force.rms_n());
  out["force"] = tally_json(run.force);
  if (!run.simulation.empty()) {
    out["simulation"] = ordered_json::parse(to_json(run.simulation));
    out["simulation"]["sentence"] = sentence(run.simulation);
  }
  return out;
}

std::string sentence(const SimulationNote& note) {
  if (note.empty()) return {};
  std::string out = "Simulated at level " + note.setting + " because " + note.because;
  if (!note.errors.empty()) out += "; " + against(note.errors.back());
  return out;
}

std::vector<std::string> error_lines(const SimulationNote& note) {
  std::vector<std::string> lines;
  for (const SimulationError& error : note.errors) {
    const sim::RunError& e = error.worst;
    const std::string pads =
        e.pads ? text("; taxels max %.0f, rms %.2g counts", e.counts_max, e.counts_rms) : "";
    lines.push_back(against(error) + pads + " (" + std::to_string(error.trials) +
                    (error.trials == 1 ? " trial" : " trials") + " played again, worst on " +
                    error.worst_fabric +
                    text("). Touch-down and ramps, which are not recorded: max %.3g mN; without a "
                         "force loop rms %.3g mN",
                         e.anywhere_max_n * 1e3, e.unled_rms_n * 1e3));
  }
  return lines;
}

std::string simulation_text(const SimulationNote& note) {
  if (note.empty()) return {};
  std::string out = wrapped(sentence(note), "  ");
  for (const std::string& line : error_lines(note)) out += wrapped(line, "    ");
  return out;
}

}  // namespace weft::daemon
