#include "daemon/apps/weft/evaluate_text.hpp"
#include "classifier/learners/multi_class_svc.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/analysis/report/confounding.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon::cli {
namespace {

using classifier::Evaluation;
using classifier::Learner;
using nlohmann::json;

std::string candidates_text(const Evaluation& e) {
  const std::size_t rounds = e.candidates.front().front().rounds;
  return tried_text(e.candidates.front()) +
         (rounds > 1 ? ", in " + std::to_string(rounds) + " rounds" : "");
}

std::string accuracy_table(const std::vector<Outcome>& outcomes) {
  Table table;
  const bool without_level = std::ranges::any_of(
      outcomes, [](const Outcome& outcome) { return outcome.level_removed.has_value(); });
  std::vector<std::string> head{"learner",  "accuracy %", "95 % interval",
                                "pooled %", "training",   "prediction"};
  if (without_level) head.emplace_back("level removed %");
  table.row(std::move(head));
  std::vector<std::pair<std::string, std::string>> methods;
  std::string choices;
  for (const Outcome& outcome : outcomes) {
    const Evaluation& e = outcome.evaluation;
    std::vector<std::string> row{outcome.name(),
                                 percent(e.accuracy, 2),
                                 percent(e.ci95.low, 2) + " to " + percent(e.ci95.high, 2),
                                 percent(e.confusion.accuracy(), 2),
                                 duration(e.train_s),
                                 fixed(e.test_s_per_sample * 1e6, 1) + " us"};
    if (without_level) row.push_back(format_level_removed(outcome.level_removed));
    table.row(std::move(row));
    methods.emplace_back(outcome.name(), e.ci95.method);
    if (is_choice(outcome.learner))
      choices += "  " + outcome.name() + " chose " + chosen_text(e) +
                 "; cross-validation of the first training part: " + candidates_text(e) + "\n";
  }
  return table.text() + choices + "  interval: " + methods_text(methods) + "\n";
}

// Texts about folds that differ from the requested ones: each once, with its learners.
std::string folds_text(const Measured& measured) {
  std::map<std::string, std::vector<std::string>> learners;
  for (const Outcome& outcome : measured.outcomes) {
    for (const auto& [words, trainings] : outcome.folds)
      learners["folds of " + std::to_string(trainings) + " of " +
               std::to_string(measured.splits.size()) + " trainings: " + words]
          .push_back(outcome.name());
  }
  std::string out;
  for (const auto& [words, names] : learners) out += "  " + joined(names) + ", " + words + "\n";
  return out;
}

// Text about a simple learner that does at least as well as every kind of cores.
std::string simple_wins_text(const std::vector<Outcome>& outcomes) {
  const Outcome* simple = nullptr;
  const Outcome* cores = nullptr;
  for (const Outcome& outcome : outcomes) {
    if (is_choice(outcome.learner)) continue;
    const bool baseline = outcome.learner == Learner::lda || outcome.learner == Learner::svc ||
                          outcome.learner == Learner::trees;
    const Outcome*& top = baseline ? simple : cores;
    if (top == nullptr || outcome.evaluation.accuracy > top->evaluation.accuracy) top = &outcome;
  }
  if (simple == nullptr || cores == nullptr ||
      simple->evaluation.accuracy < cores->evaluation.accuracy)
    return {};
  return "  Cores are not better than simpler learners: " + simple->name() + " " +
         percent(simple->evaluation.accuracy, 2) + " %, cores (" + cores->name() + ") " +
         percent(cores->evaluation.accuracy, 2) + " %.\n";
}

std::string calibration_text(const std::vector<Outcome>& outcomes) {
  std::string out;
  for (const Outcome& outcome : outcomes) {
    if (!outcome.evaluation.calibration) continue;
    const classifier::CalibrationCheck& check = *outcome.evaluation.calibration;
    Table table;
    for (const auto& row : reliability_rows(check)) table.row(row);
    out += "Calibration of " + outcome.name() + ", " + thousands(check.reliability.trials) +
           " predictions on test trials of " + thousands(check.recordings) +
           " recordings: calibration error " + format_calibration(check) + "\n" + table.text() +
           "  interval: " + bin_methods(check) + "\n";
  }
  return out;
}

std::string groups_text(const Measured& measured) {
  if (measured.groups.empty()) return {};
  Table table;
  std::vector<std::string> head{"left-out group", "test"};
  for (const Outcome& outcome : measured.outcomes) head.push_back(outcome.name());
  table.row(head);
  for (const GroupLeftOut& group : measured.groups) {
    std::vector<std::string> row{group.group, std::to_string(group.trials)};
    for (const double accuracy : group.accuracy) row.push_back(percent(accuracy, 2));
    table.row(row);
  }
  return "Accuracy % on each left-out group:\n" + table.text();
}

std::string curve_text(const std::vector<CurvePoint>& curve) {
  if (curve.empty()) return {};
  Table table;
  std::vector<std::string> head{"trials per label"};
  for (const CurveValue& value : curve.front().values) head.push_back(value.learner);
  table.row(head);
  for (const CurvePoint& point : curve) {
    std::vector<std::string> line{std::to_string(point.trials)};
    for (const CurveValue& value : point.values)
      line.push_back(percent(value.accuracy, 2) + " +- " + percent(value.deviation, 2));
    table.row(line);
  }
  return "Learning curve, accuracy % and deviation over " + std::to_string(curve.front().draws) +
         " draws of training trials:\n" + table.text();
}

// The paper's slides all last equally long. Features of slides of other lengths contain the length
// (AMB-3). With the rms norm too: Sh and Hfrq use the spectrum, with more bins for longer slides.
std::string format_motion(const MotionLengths& motion) {
  constexpr double alike = 1.05;
  if (static_cast<double>(motion.longest) <= alike * static_cast<double>(motion.shortest))
    return {};
  return std::to_string(motion.shortest) + " to " + std::to_string(motion.longest) +
         " samples per stroke: norm.M (except with --norm rms), Sh.M and Hfrq.M depend on this "
         "number, so a learner can recognise a label by stroke length alone. Use --window-s for "
         "equal lengths";
}

std::string format_groups(const std::vector<std::string>& groups) {
  constexpr std::size_t most = 10;
  const std::span<const std::string> named(groups.data(), std::min(most, groups.size()));
  return joined(named) +
         (groups.size() > most ? " and " + std::to_string(groups.size() - most) + " more" : "") +
         ": trials of one group are in training and test, and share more than the label. Compare "
         "with --leave-one-group-out";
}

// Description of the split.
std::string split_text(const EvaluateArgs& args, const std::vector<classifier::Split>& splits) {
  const std::string sizes = std::to_string(splits.front().train.size()) + " train, " +
                            std::to_string(splits.front().test.size()) + " test";
  if (args.leave_one_group_out)
    return "cross-validation over " + std::to_string(splits.size()) + " groups; first: " + sizes;
  if (args.train_fraction == 0.0)
    return "groups " + joined(args.train_groups, ",") + " train, groups " +
           joined(args.test_groups, ",") + " test: " + sizes;
  return std::to_string(args.repeats) + " random splits, " + percent(args.train_fraction, 0) +
         " % of each label for training: " + sizes;
}

std::string count_text(std::size_t count) {
  return count == 0 ? "." : std::to_string(count);
}

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
  json out{{"learner", classifier::to_string(recipe.learner)},
           {"cap", recipe.cap},
           {"view", classifier::to_string(recipe.view)}};
  if (!recipe.features.empty()) out["feature_set"] = recipe.features;
  return out;
}

// Test trials and predictions of every split.
json answers_json(const classifier::FeatureMatrix& features,
                  const std::vector<classifier::Split>& splits, const Evaluation& e) {
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
  const Evaluation& e = outcome.evaluation;
  json out = evaluation_json(e);
  if (outcome.level_removed) out["level_removed"] = json(accuracy_json(*outcome.level_removed));
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
      line["cost_s"] = score.cost_s;
      line["skipped"] = score.skipped();
      out["candidates"].push_back(std::move(line));
    }
  }
  if (e.calibration) out["calibration"] = calibration_json(*e.calibration);
  if (const classifier::FabricModel* model = e.trained.cores()) {
    out["cores"] = json::array();
    for (const CoreLine& line : core_lines(*model)) out["cores"].push_back(json(core_json(line)));
  } else if (const auto* svc = e.trained.as<classifier::MultiClassSvc>()) {
    out["C"] = svc->c();
    out["gamma"] = svc->gamma();
    out["cv_errors"] = svc->cv_errors();
  }
  return out;
}

}  // namespace

std::string format_never_tested(const std::vector<classifier::NeverTested>& labels,
                                std::string_view recordings) {
  std::vector<std::string> out;
  for (const classifier::NeverTested& one : labels)
    out.push_back(one.label + " (" + std::to_string(one.recordings) + " " +
                  std::string(recordings) +
                  (one.group.empty() ? "" : ", only in group " + one.group) + ")");
  return joined(out);
}

std::string format_duplicates(const classifier::DuplicateRows& duplicates, std::string_view rows) {
  const std::string what(rows);
  const std::string found = thousands(duplicates.found) + " of " + thousands(duplicates.tested) +
                            " tested " + what + " have the same features as a training one (" +
                            duplicates.test + " as " + duplicates.train +
                            "), like copies of one recording; ";
  if (duplicates.contradicting == 0) return found + "the accuracy is too high";
  return found +
         (duplicates.contradicting == duplicates.found ? "all"
                                                       : thousands(duplicates.contradicting)) +
         " of them have another label there, so one of the labels is wrong";
}

std::string format_balance(const classifier::Confusion& confusion) {
  return thousands(confusion.total()) + " test predictions; the most frequent label has " +
         percent(confusion.base_rate(), 1) + " % of the tests, chance is " +
         percent(1.0 / static_cast<double>(std::max<std::size_t>(1, confusion.classes())), 1) +
         " %";
}

std::vector<std::pair<std::string, std::string>> list_facts(const EvaluateArgs& args,
                                                            const ChosenTrials& chosen,
                                                            const Measured& measured) {
  const std::size_t labels = measured.outcomes.front().evaluation.confusion.classes();
  const bool windows = args.trials.window_s != 0.0;
  const std::string bench(to_string(chosen.dataset.info.kind));
  std::vector<std::pair<std::string, std::string>> out = {
      {"data", args.dataset.string() + " (" + bench + "), " + thousands(chosen.strokes) +
                   " trials" +
                   (windows ? ", " + thousands(chosen.features.size()) + " windows" : "") + ", " +
                   std::to_string(labels) + " labels"},
      {"features", std::to_string(chosen.features.names.size()) + " of " +
                       std::to_string(chosen.setup.taxels) + " taxels" +
                       (args.trials.remove_level.empty() ? "" : ", level removed")},
      {"split", split_text(args, measured.splits)}};
  if (!measured.groups_on_both_sides.empty())
    out.emplace_back("groups on both sides", format_groups(measured.groups_on_both_sides));
  for (const Warning& warning : measured.warnings) out.emplace_back("WARNING", warning.text);
  if (measured.confounded) out.emplace_back("CONFOUNDED", std::string(confounded_with_mounting));
  if (const std::string words = format_motion(chosen.motion); !words.empty())
    out.emplace_back("motion", words);
  if (!measured.never_tested.empty())
    out.emplace_back("never tested", format_never_tested(measured.never_tested, "trials"));
  if (measured.duplicates.found > 0)
    out.emplace_back("LEAK", format_duplicates(measured.duplicates,
                                               args.trials.window_s != 0.0 ? "windows" : "trials"));
  out.emplace_back("balance", format_balance(measured.outcomes.front().evaluation.confusion));
  out.emplace_back("training", describe(args.training));
  return out;
}

std::string report_text(const EvaluateArgs& args, const ChosenTrials& chosen,
                        const Measured& measured) {
  Table facts(Align::left);
  for (const auto& [name, value] : list_facts(args, chosen, measured)) facts.row({name, value});
  std::string out = bench_banner(chosen.dataset.info) + facts.text() +
                    accuracy_table(measured.outcomes) + folds_text(measured) +
                    simple_wins_text(measured.outcomes);
  for (const Outcome& outcome : measured.outcomes)
    out += "Confusion matrix, " + outcome.name() + " (rows: true label, columns: prediction):\n" +
           confusion_text(outcome.evaluation.confusion);
  return out + groups_text(measured) + calibration_text(measured.outcomes) +
         curve_text(measured.curve);
}

std::string confusion_text(const classifier::Confusion& confusion) {
  Table table;
  std::vector<std::string> head{""};
  for (std::size_t k = 0; k < confusion.classes(); ++k) head.push_back(std::to_string(k + 1));
  head.push_back("recall %");
  table.row(std::move(head));
  const std::vector<double> recall = confusion.recall();
  for (std::size_t t = 0; t < confusion.classes(); ++t) {
    std::vector<std::string> row{std::to_string(t + 1) + " " + confusion.labels[t]};
    std::size_t tested = 0;
    for (std::size_t p = 0; p < confusion.classes(); ++p) {
      row.push_back(count_text(confusion.at(t, p)));
      tested += confusion.at(t, p);
    }
    row.push_back(tested == 0 ? "-" : percent(recall[t]));
    table.row(std::move(row));
  }
  return table.text();
}

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
           {"confounded", measured.confounded ? json("mounting") : json()},
           {"labels", outcomes.front().evaluation.confusion.labels},
           {"base_rate", outcomes.front().evaluation.confusion.base_rate()},
           {"splits", splits.size()},
           {"train_rows", splits.front().train.size()},
           {"test_rows", splits.front().test.size()},
           {"never_tested", never_tested_json(measured.never_tested)},
           {"twins", duplicates_json(measured.duplicates)},
           {"groups_on_both_sides", measured.groups_on_both_sides},
           {"warnings", measured.warnings},
           {"motion_samples", {chosen.motion.shortest, chosen.motion.longest}},
           {"training", describe(args.training)},
           {"results", results}};
  if (!measured.groups.empty()) out["groups"] = groups_json(measured);
  if (!measured.curve.empty()) out["learning_curve"] = curve_json(measured);
  return out;
}

}  // namespace weft::daemon::cli
