#include "daemon/cli/evaluate_command.hpp"

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "classifier/evaluate/evaluate.hpp"
#include "classifier/evaluate/permutation.hpp"
#include "daemon/cli/table.hpp"
#include "daemon/loop/wall_clock.hpp"
#include "daemon/report/format.hpp"
#include "daemon/report/json_parts.hpp"

namespace weft::daemon::cli {
namespace {

using classifier::Evaluation;
using classifier::Reduction;
using nlohmann::json;

struct Outcome {
  Reduction reduction;
  Evaluation evaluation;
};

Result<std::vector<Reduction>> reductions_of(const std::string& word) {
  if (word == "every")
    return std::vector{Reduction::pvalue, Reduction::pca, Reduction::all, Reduction::best};
  const auto one = classifier::reduction_from(word);
  if (!one) return pass(one.error(), "--reduction");
  return std::vector{*one};
}

std::string split_text(const EvaluateArgs& args, const classifier::Split& first) {
  const std::string sizes =
      std::to_string(first.train.size()) + " train, " + std::to_string(first.test.size()) + " test";
  if (args.train_fraction == 0.0)
    return "groups " + joined(args.train_groups, ",") + " train, groups " +
           joined(args.test_groups, ",") + " test: " + sizes;
  return std::to_string(args.repeats) + " random splits of " + percent(args.train_fraction, 0) +
         " % of each label: " + sizes;
}

std::string accuracy_table(const std::vector<Outcome>& outcomes) {
  Table table;
  table.row({"reduction", "accuracy %", "95 % interval", "training", "test, each"});
  for (const auto& [reduction, e] : outcomes)
    table.row({std::string(classifier::to_string(reduction)), percent(e.accuracy, 2),
               percent(e.ci95.low, 2) + " to " + percent(e.ci95.high, 2), duration(e.train_s),
               fixed(e.test_s_per_sample * 1e6, 1) + " us"});
  std::vector<std::pair<std::string, std::string>> methods;
  for (const auto& [reduction, e] : outcomes)
    methods.emplace_back(classifier::to_string(reduction), e.ci95.method);
  return table.text() + "  interval: " + methods_text(methods) + "\n";
}

std::string report_text(const EvaluateArgs& args, const ChosenTrials& chosen,
                        const std::vector<classifier::Split>& splits,
                        const std::vector<Outcome>& outcomes) {
  const std::size_t labels = outcomes.front().evaluation.confusion.classes();
  const bool windows = args.trials.window_s != 0.0;
  Table facts(Align::left);
  facts.row({"data", args.dataset.string() + " (" +
                         std::string(to_string(chosen.dataset.info.kind)) + "), " +
                         thousands(chosen.strokes) + " trials" +
                         (windows ? ", " + thousands(chosen.features.size()) + " windows" : "") +
                         ", " + std::to_string(labels) + " labels"});
  facts.row({"features", std::to_string(chosen.features.names.size()) + " of " +
                             std::to_string(chosen.setup.taxels) + " taxels"});
  facts.row({"split", split_text(args, splits.front())});
  facts.row({"training", describe(args.training)});
  std::string out =
      bench_banner(chosen.dataset.info.kind) + facts.text() + accuracy_table(outcomes);
  for (const auto& [reduction, e] : outcomes)
    out += "Confusion, " + std::string(classifier::to_string(reduction)) +
           " (row: true label, column: answer):\n" + confusion_text(e.confusion);
  return out;
}

json outcome_json(const Evaluation& e) {
  json out = evaluation_json(e);
  out["chosen_reduction"] = classifier::to_string(e.model.reduction());
  out["cores"] = json::array();
  for (const CoreLine& line : core_lines(e.model)) out["cores"].push_back(json(core_json(line)));
  return out;
}

json report_json(const EvaluateArgs& args, const ChosenTrials& chosen,
                 const std::vector<classifier::Split>& splits,
                 const std::vector<Outcome>& outcomes) {
  json results;
  for (const auto& [reduction, e] : outcomes)
    results[std::string(classifier::to_string(reduction))] = outcome_json(e);
  return {{"command", "evaluate"},
          {"dataset", args.dataset.string()},
          {"dataset_sha256", chosen.sha256},
          {"bench", to_string(chosen.dataset.info.kind)},
          {"trials", chosen.strokes},
          {"rows", chosen.features.size()},
          {"features", chosen.features.names.size()},
          {"taxels", chosen.setup.taxels},
          {"exploration", chosen.setup.exploration},
          {"window_s", args.trials.window_s},
          {"labels", outcomes.front().evaluation.confusion.labels},
          {"splits", splits.size()},
          {"train_rows", splits.front().train.size()},
          {"test_rows", splits.front().test.size()},
          {"training", describe(args.training)},
          {"results", results}};
}

// What the same training reaches when the labels are in random order, beside every outcome.
Status add_permuted(const EvaluateArgs& args, const ChosenTrials& chosen,
                    const std::vector<Outcome>& outcomes, std::string& text, json& out) {
  text += "Labels in random order:\n";
  for (const Outcome& outcome : outcomes) {
    const auto permuted = classifier::evaluate_permuted(
        chosen.features, train_options(args.training, outcome.reduction),
        {args.train_fraction, args.permute_labels, 1});
    if (!permuted) return pass(permuted.error(), args.dataset.string());
    const std::string name(classifier::to_string(outcome.reduction));
    out["results"][name]["permuted"] = {{"accuracy", permuted->mean},
                                        {"accuracy_of_permutations", permuted->accuracy},
                                        {"chance", permuted->chance},
                                        {"tested", permuted->trials}};
    text += "  " + name + " " + percent(permuted->mean, 2) + " % of " +
            thousands(permuted->trials) + " answers over " + std::to_string(args.permute_labels) +
            " permutations, chance " + percent(permuted->chance, 2) + " %\n";
  }
  return {};
}

void add_split_options(CLI::App& command, EvaluateArgs& args) {
  auto* train = command.add_option("--train-groups", args.train_groups, "groups that train: A,B");
  auto* test = command.add_option("--test-groups", args.test_groups, "groups that test: C");
  train->delimiter(',')->allow_extra_args(false)->needs(test);
  test->delimiter(',')->allow_extra_args(false)->needs(train);
  auto* fraction = command.add_option("--train-fraction", args.train_fraction,
                                      "share of each label's trials that trains, such as 0.4");
  fraction->excludes(train)->check(CLI::Range(0.001, 0.999));
  command
      .add_option("--permute-labels", args.permute_labels,
                  "also train and test with labels in random order, so often: must give chance")
      ->needs(fraction)
      ->check(CLI::Range(1, 100000));
  command.add_option("--repeats", args.repeats, "random splits")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
}

}  // namespace

void add_options(CLI::App& command, EvaluateArgs& args) {
  command.add_option("DATASET", args.dataset, "data set (HDF5)")->required();
  add_split_options(command, args);
  command
      .add_option(
          "--reduction", args.reduction,
          "of the features; best: chosen by cross-validation on the training part; every: all four")
      ->check(CLI::IsMember({"pvalue", "pca", "all", "best", "every"}))
      ->capture_default_str();
  add_trial_options(command, args.trials);
  add_train_options(command, args.training);
}

Result<std::vector<classifier::Split>> splits_of(const EvaluateArgs& args,
                                                 const classifier::FeatureMatrix& features) {
  if (!args.train_groups.empty()) {
    auto split = classifier::grouped_split(features.groups, args.train_groups, args.test_groups);
    if (!split) return pass(split.error());
    return std::vector{std::move(*split)};
  }
  if (args.train_fraction == 0.0)
    return fail(Errc::invalid_argument, "no split given", {},
                "--train-groups with --test-groups, or "
                "--train-fraction");
  if (args.trials.window_s != 0.0)
    return fail(Errc::invalid_argument,
                "a random split would put windows of one recording on both sides",
                "--train-fraction", {}, {}, "Use --train-groups and --test-groups with --window-s");
  return classifier::stratified_splits(features.labels, args.train_fraction, args.repeats,
                                       args.training.seed);
}

Result<int> run_evaluate(const EvaluateArgs& args, Console& console) {
  const auto reductions = reductions_of(args.reduction);
  if (!reductions) return pass(reductions.error());
  const Result<ChosenTrials> chosen = load_trials(args.dataset, args.trials, true);
  if (!chosen) return pass(chosen.error());
  const auto splits = splits_of(args, chosen->features);
  if (!splits) return pass(splits.error());
  std::vector<Outcome> outcomes;
  for (const Reduction reduction : *reductions) {
    auto evaluation = classifier::evaluate(
        chosen->features, *splits, train_options(args.training, reduction), steady_wall_seconds);
    if (!evaluation) return pass(evaluation.error(), args.dataset.string());
    outcomes.push_back({reduction, std::move(*evaluation)});
  }
  std::string text = report_text(args, *chosen, *splits, outcomes);
  json out = report_json(args, *chosen, *splits, outcomes);
  if (args.permute_labels > 0)
    if (Status ok = add_permuted(args, *chosen, outcomes, text, out); !ok) return pass(ok.error());
  print(console, text, out);
  return exit_ok;
}

}  // namespace weft::daemon::cli
