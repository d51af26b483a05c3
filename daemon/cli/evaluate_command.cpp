#include "daemon/cli/evaluate_command.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "classifier/evaluate/evaluate.hpp"
#include "classifier/evaluate/permutation.hpp"
#include "daemon/cli/table.hpp"
#include "daemon/loop/wall_clock.hpp"
#include "daemon/report/format.hpp"
#include "daemon/report/json_parts.hpp"

namespace weft::daemon::cli {
namespace {

using classifier::Learner;
using classifier::LearnerEvaluation;
using nlohmann::json;

struct Outcome {
  Learner learner;
  LearnerEvaluation evaluation;
  [[nodiscard]] std::string name() const { return std::string(classifier::to_string(learner)); }
};

// "every" leaves cores-best out: best tries the same candidates and two more kinds.
Result<std::vector<Learner>> learners_of(const std::vector<std::string>& words) {
  std::vector<Learner> out;
  for (const std::string& word : words) {
    if (word == "every") {
      out = classifier::all_learners();
      std::erase(out, Learner::cores_best);
      return out;
    }
    const auto one = classifier::learner_from(word);
    if (!one) return pass(one.error(), "--learner");
    if (std::find(out.begin(), out.end(), *one) == out.end()) out.push_back(*one);
  }
  return out;
}

classifier::TrainOptions options_of(const EvaluateArgs& args) {
  return train_options(args.training, classifier::Reduction::pvalue);
}

std::string split_text(const EvaluateArgs& args, const std::vector<classifier::Split>& splits) {
  const std::string sizes = std::to_string(splits.front().train.size()) + " train, " +
                            std::to_string(splits.front().test.size()) + " test";
  if (args.leave_one_group_out)
    return "each of " + std::to_string(splits.size()) + " groups left out in turn; first: " + sizes;
  if (args.train_fraction == 0.0)
    return "groups " + joined(args.train_groups, ",") + " train, groups " +
           joined(args.test_groups, ",") + " test: " + sizes;
  return std::to_string(args.repeats) + " random splits of " + percent(args.train_fraction, 0) +
         " % of each label: " + sizes;
}

bool is_choice(Learner learner) {
  return learner == Learner::best || learner == Learner::cores_best;
}

// "lda" or "lda 4, svc 1": what a choice came to, and how often.
std::string chosen_text(const LearnerEvaluation& e) {
  std::map<std::string, std::size_t> count;
  for (const auto& recipe : e.recipes) ++count[to_string(recipe)];
  std::vector<std::string> out;
  for (const auto& [name, splits] : count)
    out.push_back(count.size() == 1 ? name : name + " (" + std::to_string(splits) + " splits)");
  return joined(out);
}

std::string candidates_text(const LearnerEvaluation& e) {
  std::vector<std::string> out;
  for (const auto& score : e.candidates.front())
    out.push_back(to_string(score.recipe) + " " + std::to_string(score.errors) + "/" +
                  std::to_string(score.tested));
  return joined(out, "; ");
}

std::string accuracy_table(const std::vector<Outcome>& outcomes) {
  Table table;
  table.row(
      {"learner", "accuracy %", "95 % interval", "of all answers %", "training", "test, each"});
  std::vector<std::pair<std::string, std::string>> methods;
  std::string choices;
  for (const Outcome& outcome : outcomes) {
    const LearnerEvaluation& e = outcome.evaluation;
    table.row({outcome.name(), percent(e.accuracy, 2),
               percent(e.ci95.low, 2) + " to " + percent(e.ci95.high, 2),
               percent(e.confusion.accuracy(), 2), duration(e.train_s),
               fixed(e.test_s_per_sample * 1e6, 1) + " us"});
    methods.emplace_back(outcome.name(), e.ci95.method);
    if (is_choice(outcome.learner))
      choices += "  " + outcome.name() + " chose " + chosen_text(e) +
                 "; errors in cross-validation of the first training part: " + candidates_text(e) +
                 "\n";
  }
  return table.text() + choices + "  interval: " + methods_text(methods) + "\n";
}

// A simple learner that does at least as well as every kind of cores, in words.
std::string simple_wins_text(const std::vector<Outcome>& outcomes) {
  const Outcome* simple = nullptr;
  const Outcome* cores = nullptr;
  for (const Outcome& outcome : outcomes) {
    if (is_choice(outcome.learner)) continue;
    const bool baseline = outcome.learner == Learner::lda || outcome.learner == Learner::svc;
    const Outcome*& top = baseline ? simple : cores;
    if (top == nullptr || outcome.evaluation.accuracy > top->evaluation.accuracy) top = &outcome;
  }
  if (simple == nullptr || cores == nullptr ||
      simple->evaluation.accuracy < cores->evaluation.accuracy)
    return {};
  return "  The simple thing is not beaten: " + simple->name() + " " +
         percent(simple->evaluation.accuracy, 2) + " %, cores (" + cores->name() + ") " +
         percent(cores->evaluation.accuracy, 2) + " %.\n";
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
                             std::to_string(chosen.setup.taxels) + " taxels" +
                             (args.trials.remove_level.empty() ? "" : ", level removed")});
  facts.row({"split", split_text(args, splits)});
  facts.row({"training", describe(args.training)});
  std::string out = bench_banner(chosen.dataset.info.kind) + facts.text() +
                    accuracy_table(outcomes) + simple_wins_text(outcomes);
  for (const Outcome& outcome : outcomes)
    out += "Confusion, " + outcome.name() + " (row: true label, column: answer):\n" +
           confusion_text(outcome.evaluation.confusion);
  return out;
}

json recipe_json(const classifier::Recipe& recipe) {
  return {{"learner", classifier::to_string(recipe.learner)},
          {"cap", recipe.cap},
          {"compressed", recipe.compressed}};
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
  out["chosen"] = json::array();
  for (const auto& recipe : e.recipes) out["chosen"].push_back(recipe_json(recipe));
  if (is_choice(outcome.learner)) {
    out["candidates"] = json::array();
    for (const auto& score : e.candidates.front()) {
      json line = recipe_json(score.recipe);
      line["errors"] = score.errors;
      line["tested"] = score.tested;
      out["candidates"].push_back(std::move(line));
    }
  }
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

json report_json(const EvaluateArgs& args, const ChosenTrials& chosen,
                 const std::vector<classifier::Split>& splits,
                 const std::vector<Outcome>& outcomes) {
  json results;
  for (const Outcome& outcome : outcomes) {
    results[outcome.name()] = outcome_json(outcome);
    if (args.answers)
      results[outcome.name()]["answers"] =
          answers_json(chosen.features, splits, outcome.evaluation);
  }
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
          {"remove_level", args.trials.remove_level},
          {"labels", outcomes.front().evaluation.confusion.labels},
          {"splits", splits.size()},
          {"train_rows", splits.front().train.size()},
          {"test_rows", splits.front().test.size()},
          {"training", describe(args.training)},
          {"results", results}};
}

Result<std::vector<Outcome>> evaluate_all(const EvaluateArgs& args,
                                          const std::vector<Learner>& learners,
                                          const classifier::FeatureMatrix& features,
                                          const std::vector<classifier::Split>& splits) {
  std::vector<Outcome> out;
  for (const Learner learner : learners) {
    auto evaluation =
        classifier::evaluate(features, splits, learner, options_of(args), steady_wall_seconds);
    if (!evaluation) return pass(evaluation.error(), args.dataset.string());
    if (args.leave_one_group_out && args.curve.empty())
      evaluation->ci95.method =
          "Student t with the Nadeau-Bengio variance, over the groups left out";
    out.push_back({learner, std::move(*evaluation)});
  }
  return out;
}

// Accuracy against training recordings of each label.
Status add_curve(const EvaluateArgs& args, const std::vector<Learner>& learners,
                 const classifier::FeatureMatrix& features,
                 const std::vector<classifier::Split>& splits, std::string& text, json& out) {
  if (args.curve.empty()) return {};
  Table table;
  std::vector<std::string> head{"trials of each"};
  for (const Learner learner : learners) head.emplace_back(classifier::to_string(learner));
  table.row(head);
  out["learning_curve"] = json::array();
  for (const std::size_t trials : args.curve) {
    const auto thin = classifier::thinned(splits, features.labels, features.files, trials,
                                          args.curve_draws, args.training.seed);
    if (!thin) return pass(thin.error(), "--learning-curve");
    const auto outcomes = evaluate_all(args, learners, features, *thin);
    if (!outcomes) return pass(outcomes.error());
    std::vector<std::string> line{std::to_string(trials)};
    json point{{"trials", trials}, {"splits", thin->size()}, {"accuracy", json::object()}};
    for (const Outcome& outcome : *outcomes) {
      const LearnerEvaluation& e = outcome.evaluation;
      line.push_back(percent(e.accuracy, 2) + " +- " + percent(e.deviation, 2));
      point["accuracy"][outcome.name()] = {{"mean", e.accuracy}, {"deviation", e.deviation}};
    }
    table.row(line);
    out["learning_curve"].push_back(std::move(point));
  }
  text += "Learning curve, accuracy % and deviation over " +
          std::to_string(splits.size() * args.curve_draws) + " draws of training trials:\n" +
          table.text();
  return {};
}

// What the same training reaches when the labels are in random order, beside every outcome.
Status add_permuted(const EvaluateArgs& args, const ChosenTrials& chosen,
                    const std::vector<Outcome>& outcomes, std::string& text, json& out) {
  if (args.permute_labels == 0) return {};
  text += "Labels in random order:\n";
  for (const Outcome& outcome : outcomes) {
    const auto permuted =
        classifier::evaluate_permuted(chosen.features, outcome.learner, options_of(args),
                                      {args.train_fraction, args.permute_labels, 1});
    if (!permuted) return pass(permuted.error(), args.dataset.string());
    const std::string name = outcome.name();
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
      .add_flag("--leave-one-group-out", args.leave_one_group_out,
                "every group tests once, all others train; try --fold-unit group with it")
      ->excludes(train)
      ->excludes(fraction);
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
          "--learner,--reduction", args.learners,
          "cores with p-value, PCA or all features; lda: shrinkage LDA; svc: one multi-class "
          "SVC; cores-best, best: chosen by cross-validation of the whole learner on the "
          "training part; every: all of them")
      ->check(CLI::IsMember({"pvalue", "pca", "all", "cores-pvalue", "cores-pca", "cores-all",
                             "lda", "svc", "cores-best", "best", "every"}))
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  command
      .add_option("--learning-curve", args.curve,
                  "also with so many training trials of each label: 2,4,8")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::Range(2, 1000000));
  command.add_flag("--answers", args.answers, "with --json: the answer on every test trial");
  command.add_option("--curve-draws", args.curve_draws, "random draws for each split and number")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
  add_trial_options(command, args.trials);
  add_level_option(command, args.trials);
  add_train_options(command, args.training);
}

Result<std::vector<classifier::Split>> splits_of(const EvaluateArgs& args,
                                                 const classifier::FeatureMatrix& features) {
  if (!args.train_groups.empty()) {
    auto split = classifier::grouped_split(features.groups, args.train_groups, args.test_groups);
    if (!split) return pass(split.error());
    return std::vector{std::move(*split)};
  }
  if (args.leave_one_group_out)
    return classifier::leave_one_group_out(features.groups, features.labels);
  if (args.train_fraction == 0.0)
    return fail(Errc::invalid_argument, "no split given", {},
                "--train-groups with --test-groups, --leave-one-group-out, or --train-fraction");
  if (args.trials.window_s != 0.0)
    return fail(Errc::invalid_argument,
                "a random split would put windows of one recording on both sides",
                "--train-fraction", {}, {}, "Use --train-groups and --test-groups with --window-s");
  return classifier::stratified_splits(features.labels, args.train_fraction, args.repeats,
                                       args.training.seed);
}

Result<int> run_evaluate(const EvaluateArgs& args, Console& console) {
  const auto learners = learners_of(args.learners);
  if (!learners) return pass(learners.error());
  const Result<ChosenTrials> chosen = load_trials(args.dataset, args.trials, true, true);
  if (!chosen) return pass(chosen.error());
  const auto splits = splits_of(args, chosen->features);
  if (!splits) return pass(splits.error());
  const auto outcomes = evaluate_all(args, *learners, chosen->features, *splits);
  if (!outcomes) return pass(outcomes.error());
  std::string text = report_text(args, *chosen, *splits, *outcomes);
  json out = report_json(args, *chosen, *splits, *outcomes);
  if (Status ok = add_permuted(args, *chosen, *outcomes, text, out); !ok) return pass(ok.error());
  if (Status ok = add_curve(args, *learners, chosen->features, *splits, text, out); !ok)
    return pass(ok.error());
  print(console, text, out);
  return exit_ok;
}

}  // namespace weft::daemon::cli
