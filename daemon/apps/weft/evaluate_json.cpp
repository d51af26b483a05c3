#include <nlohmann/json.hpp>

#include "daemon/analysis/report/report.hpp"
#include "daemon/apps/weft/evaluate_text.hpp"

namespace weft::daemon::cli {
namespace {

using classifier::LearnerEvaluation;
using nlohmann::json;

json calibration_json(const classifier::CalibrationCheck& check) {
  json bins = json::array();
  for (std::size_t b = 0; b < check.bins.size(); ++b) {
    const classifier::ReliabilityBin& bin = check.reliability.bins[b];
    const classifier::Interval& right = check.bins[b].observed_ci95;
    bins.push_back({{"low", bin.low},
                    {"high", bin.high},
                    {"answers", bin.count},
                    {"recordings", check.bins[b].recordings},
                    {"said", bin.predicted},
                    {"right", bin.observed},
                    {"ci95", {right.low, right.high}},
                    {"ci95_method", right.method}});
  }
  return {{"answers", check.reliability.trials},
          {"recordings", check.recordings},
          {"calibration_error", check.reliability.calibration_error},
          {"ci95", {check.calibration_error_ci95.low, check.calibration_error_ci95.high}},
          {"ci95_method", check.calibration_error_ci95.method},
          {"brier", check.reliability.brier},
          {"log_loss", check.reliability.log_loss},
          {"bins", std::move(bins)}};
}

json groups_json(const Measured& measured) {
  json out = json::array();
  for (const GroupLeftOut& group : measured.groups) {
    json one{{"group", group.group}, {"trials", group.trials}, {"accuracy", json::object()}};
    for (std::size_t k = 0; k < measured.outcomes.size(); ++k)
      one["accuracy"][measured.outcomes[k].name()] = group.accuracy[k];
    out.push_back(std::move(one));
  }
  return out;
}

json curve_json(const Measured& measured) {
  json out = json::array();
  for (const CurvePoint& point : measured.curve) {
    json one{{"trials", point.trials},
             {"splits", measured.splits.size()},
             {"draws", point.draws},
             {"accuracy", json::object()}};
    for (const CurveValue& value : point.values)
      one["accuracy"][value.learner] = {{"mean", value.accuracy},
                                        {"deviation", value.deviation},
                                        {"ci95", {value.ci95.low, value.ci95.high}},
                                        {"ci95_method", value.ci95.method}};
    out.push_back(std::move(one));
  }
  return out;
}

json recipe_json(const classifier::Recipe& recipe) {
  return {{"learner", classifier::to_string(recipe.learner)},
          {"cap", recipe.cap},
          {"view", classifier::to_string(recipe.view)}};
}

// Test trials and answers of every split.
json answers_json(const classifier::FeatureMatrix& features,
                  const std::vector<classifier::Split>& splits, const LearnerEvaluation& e) {
  json out = json::array();
  for (std::size_t s = 0; s < splits.size(); ++s) {
    json of_split = json::array();
    for (std::size_t i = 0; i < splits[s].test.size(); ++i)
      of_split.push_back({features.files[splits[s].test[i]], e.confusion.labels[e.answers[s][i]]});
    out.push_back(std::move(of_split));
  }
  return out;
}

json outcome_json(const Outcome& outcome) {
  const LearnerEvaluation& e = outcome.evaluation;
  json out = evaluation_json(e);
  out["pooled_accuracy"] = e.confusion.accuracy();
  if (!outcome.folds.empty()) out["folds"] = outcome.folds;
  out["chosen"] = json::array();
  for (const auto& recipe : e.recipes) out["chosen"].push_back(recipe_json(recipe));
  if (is_choice(outcome.learner)) {
    out["candidates"] = json::array();
    for (const auto& score : e.candidates.front()) {
      json line = recipe_json(score.recipe);
      line["errors"] = score.errors;
      line["tested"] = score.tested;
      line["rounds"] = score.rounds;
      out["candidates"].push_back(std::move(line));
    }
  }
  if (e.calibration) out["calibration"] = calibration_json(*e.calibration);
  const auto& machine = e.trained.machine();
  if (const auto* model = std::get_if<classifier::FabricModel>(&machine)) {
    out["cores"] = json::array();
    for (const CoreLine& line : core_lines(*model)) out["cores"].push_back(json(core_json(line)));
  } else if (const auto* svc = std::get_if<classifier::MultiClassSvc>(&machine)) {
    out["C"] = svc->c();
    out["gamma"] = svc->gamma();
    out["cv_errors"] = svc->cv_errors();
  }
  return out;
}

}  // namespace

json never_tested_json(const std::vector<classifier::NeverTested>& labels) {
  json out = json::array();
  for (const classifier::NeverTested& one : labels)
    out.push_back({{"label", one.label},
                   {"recordings", one.recordings},
                   {"group", one.group.empty() ? json() : json(one.group)}});
  return out;
}

json duplicates_json(const classifier::DuplicateRows& duplicates) {
  return {{"tested", duplicates.tested},
          {"found", duplicates.found},
          {"contradicting", duplicates.contradicting},
          {"test", duplicates.test},
          {"train", duplicates.train}};
}

json too_short_json(const std::vector<classifier::vibro::TooShort>& recordings) {
  json out = json::array();
  for (const classifier::vibro::TooShort& one : recordings) out.push_back(one.file);
  return out;
}

json report_json(const EvaluateArgs& args, const ChosenTrials& chosen, const Measured& measured) {
  const std::vector<classifier::Split>& splits = measured.splits;
  const std::vector<Outcome>& outcomes = measured.outcomes;
  json results;
  for (const Outcome& outcome : outcomes) {
    results[outcome.name()] = outcome_json(outcome);
    if (args.answers)
      results[outcome.name()]["answers"] =
          answers_json(chosen.features, splits, outcome.evaluation);
  }
  json out{{"command", "evaluate"},
           {"dataset", args.dataset.string()},
           {"dataset_sha256", chosen.sha256},
           {"bench", to_string(chosen.dataset.info.kind)},
           {"ended_early", json(ended_early_json(chosen.dataset.info))},
           {"trials", chosen.strokes},
           {"rows", chosen.features.size()},
           {"features", chosen.features.names.size()},
           {"taxels", chosen.setup.taxels},
           {"exploration", chosen.setup.exploration},
           {"window_s", args.trials.window_s},
           {"remove_level", args.trials.remove_level},
           {"labels", outcomes.front().evaluation.confusion.labels},
           {"splits", splits.size()},
           {"train_rows", splits.front().train.size()},
           {"test_rows", splits.front().test.size()},
           {"never_tested", never_tested_json(measured.never_tested)},
           {"twins", duplicates_json(measured.duplicates)},
           {"motion_samples", {chosen.motion.shortest, chosen.motion.longest}},
           {"training", describe(args.training)},
           {"results", results}};
  if (!measured.groups.empty()) out["groups"] = groups_json(measured);
  if (!measured.curve.empty()) out["learning_curve"] = curve_json(measured);
  return out;
}

}  // namespace weft::daemon::cli
