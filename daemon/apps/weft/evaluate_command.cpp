#include <nlohmann/json.hpp>

#include "classifier/evaluate/evaluate.hpp"
#include "classifier/evaluate/open_set_check.hpp"
#include "daemon/apps/weft/commands.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/evaluate_text.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/apps/weft/page_files.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/interval_text.hpp"

namespace weft::daemon::cli {
namespace {

using nlohmann::json;

// Adds to every outcome the accuracy of the same training with labels in random order.
Status add_permuted(const EvaluateArgs& args, const ChosenTrials& chosen,
                    const std::vector<Outcome>& outcomes, std::string& text, json& out) {
  if (args.permute_labels == 0) return {};
  text += "Shuffled labels:\n";
  for (const Outcome& outcome : outcomes) {
    const classifier::TrainOptions options = train_options(args.training);
    const LearningTask task = learning_task(chosen, outcome.learner, options.cap);
    const auto permuted = classifier::evaluate_permuted(
        task.matrix, task.candidates, options, {args.train_fraction, args.permute_labels, 1});
    if (!permuted) return pass(permuted.error(), args.dataset.string());
    const std::string name = outcome.name();
    out["results"][name]["permuted"] = {{"accuracy", permuted->mean},
                                        {"accuracy_of_permutations", permuted->accuracy},
                                        {"chance", permuted->chance},
                                        {"tested", permuted->trials}};
    text += "  " + name + " " + percent(permuted->mean, 2) + " % of " +
            thousands(permuted->trials) + " predictions over " +
            std::to_string(args.permute_labels) + " permutations, chance " +
            percent(permuted->chance, 2) + " %\n";
  }
  return {};
}

// Adds to every outcome how often a left-out fabric is predicted as another.
Status add_unknown_labels(const EvaluateArgs& args, const ChosenTrials& chosen,
                          const Measured& measured, std::string& text, json& out) {
  if (!args.none_of_these) return {};
  text += "Unknown fabrics, each fabric left out of the training once:\n";
  for (const Outcome& outcome : measured.outcomes) {
    const LearningTask task = learning_task(chosen, outcome.learner, args.training.cap);
    const auto found = classifier::check_open_set(
        task.matrix, measured.splits, outcome.evaluation.recipes, train_options(args.training));
    if (!found) return pass(found.error(), args.dataset.string());
    json unknown_labels = json::array();
    std::size_t trials = 0, answers = 0;
    for (const classifier::UnknownLabel& one : found->unknown_labels) {
      trials += one.trials;
      answers += one.answers;
      unknown_labels.push_back({{"label", one.label},
                                {"trials", one.trials},
                                {"answers", one.answers},
                                {"accepted", one.accepted}});
    }
    classifier::Interval ci = found->false_accept_ci95;
    if (args.leave_one_group_out) name_groups_left_out(ci);
    out["results"][outcome.name()]["none_of_these"] = {{"false_accept", found->false_accept},
                                                       {"ci95", {ci.low, ci.high}},
                                                       {"ci95_method", ci.method},
                                                       {"false_reject", found->false_reject},
                                                       {"strangers", unknown_labels},
                                                       {"not_measured", found->not_measured}};
    text +=
        "  " + outcome.name() + " accepts " + percent(found->false_accept, 1) + " % (" +
        percent(ci.low, 1) + " to " + percent(ci.high, 1) + ") of " + thousands(trials) +
        " trials of unknown fabrics" +
        (answers == trials ? ""
                           : " (" + thousands(answers) + " predictions over " +
                                 std::to_string(measured.splits.size()) + " splits)") +
        ", and rejects " + percent(found->false_reject, 1) + " % of the trials of known fabrics" +
        (found->not_measured.empty()
             ? ""
             : "; not measured, because of too few other trials: " + joined(found->not_measured)) +
        "\n    interval: " + ci.method + "\n";
  }
  return {};
}

Status write_page(const EvaluateArgs& args, const ChosenTrials& chosen, const Measured& measured,
                  const json& record) {
  if (args.report.empty()) return {};
  std::vector<EvaluatedLearner> learners;
  for (const Outcome& outcome : measured.outcomes)
    learners.push_back({outcome.name(), outcome.evaluation,
                        is_choice(outcome.learner) ? chosen_text(outcome.evaluation) : "",
                        outcome.level_removed});
  const EvaluationPage page{chosen.dataset.info.kind,
                            args.dataset.filename().string(),
                            list_facts(args, chosen, measured),
                            seconds_of_features(args.trials, chosen, steady_wall_seconds),
                            learners,
                            measured.groups,
                            measured.curve};
  return write_page_files(args.report, record, evaluation_document(page));
}

Result<int> run_evaluate(const EvaluateArgs& args, Console& console) {
  if (is_about_recordings(args.trials, args.dataset,
                          !args.recordings.methods.empty() || args.recordings.importance > 0))
    return run_evaluate_recordings(args, console);
  if (!args.report.empty())
    if (Status ok = check_page(args.dataset, args.report); !ok) return pass(ok.error());
  const Result<ChosenTrials> chosen = load_trials(args.dataset, args.trials, true, true);
  if (!chosen) return pass(chosen.error());
  const Result<Measured> measured = measure(args, *chosen);
  if (!measured) return pass(measured.error());
  json out = report_json(args, *chosen, *measured);
  // The page excludes the results below, which train again and may fail.
  if (Status ok = write_page(args, *chosen, *measured, out); !ok) return pass(ok.error());
  std::string text = report_text(args, *chosen, *measured);
  if (Status ok = add_permuted(args, *chosen, measured->outcomes, text, out); !ok)
    return pass(ok.error());
  if (Status ok = add_unknown_labels(args, *chosen, *measured, text, out); !ok)
    return pass(ok.error());
  print(console, text, out);
  return exit_ok;
}

}  // namespace

namespace {

/// Measurements beside the accuracy, for slides and imprints.
void add_measure_options(CLI::App& command, EvaluateArgs& args) {
  command
      .add_option("--permute-labels", args.permute_labels,
                  "repeat N times with shuffled labels; accuracy should drop to chance")
      ->needs("--train-fraction")
      ->check(CLI::Range(1, 100000));
  add_list(command, "--learning-curve", args.curve,
           "also train with these numbers of trials per label (comma-separated)")
      ->check(CLI::Range(2, 1000000));
  command.add_flag("--calibration", args.calibration,
                   "also compare predicted probabilities with observed shares");
  command.add_flag("--none-of-these", args.none_of_these,
                   "also test how often an unknown fabric is predicted as a known one");
  command.add_flag("--answers", args.answers,
                   "list the prediction of every test trial in the --json output");
  add_count(command, "--curve-draws", args.curve_draws, 1, 1000,
            "draw this number of training sets per split and number of trials");
}

}  // namespace

void add_options(CLI::App& command, EvaluateArgs& args) {
  LearningOptions options(command, args.trials.modality, args.trials.given);
  command.add_option("DATASET", args.dataset, "data set (HDF5)")->required();
  add_split_options(command, args, "train on this share of each label's trials, such as 0.4",
                    "test each group once, with all others as training");
  add_count(command, "--repeats", args.repeats, 1, 100000, "use this number of random splits");
  add_learners_option(
      options.place_of("--learner"), args.trials.modality ? "--learner" : "--learner,--reduction",
      args.learners,
      "evaluate these learners (comma-separated: lda, svc, pvalue, best, every, ...)")
      ->capture_default_str();
  command.add_option("--report", args.report, "also write the evaluation to this page (HTML)");
  add_measure_options(command, args);
  add_trial_options(command, options, args.trials);
  add_level_option(command, args.trials);
  add_train_options(command, args.training);
  add_recording_options(command, options, args.recordings);
  options.finish();
}

void add_split_options(CLI::App& command, SplitChoice& choice, const std::string& fraction,
                       const std::string& leave_out) {
  auto* train = add_name_list(command, "--train-groups", choice.train_groups,
                              "train on these groups (comma-separated)");
  auto* test = add_name_list(command, "--test-groups", choice.test_groups,
                             "test on these groups (comma-separated)");
  train->needs(test);
  test->needs(train);
  auto* random = command.add_option("--train-fraction", choice.train_fraction, fraction);
  random->excludes(train)->check(number_range(0.001, 0.999));
  command.add_flag("--leave-one-group-out", choice.leave_one_group_out, leave_out)
      ->excludes(train)
      ->excludes(random);
}

Result<std::vector<classifier::Split>> make_splits(const EvaluateArgs& args,
                                                   const classifier::FeatureMatrix& features) {
  if (!args.train_groups.empty()) {
    auto split = classifier::grouped_split(features.groups, args.train_groups, args.test_groups);
    if (!split) return pass(split.error());
    return std::vector{std::move(*split)};
  }
  if (args.leave_one_group_out)
    return classifier::leave_one_group_out(features.groups, features.labels);
  if (args.train_fraction == 0.0)
    return fail(
        {.code = Errc::invalid_argument,
         .what = "no split given",
         .expected =
             "--train-groups with --test-groups, --leave-one-group-out, or --train-fraction"});
  if (args.trials.window_s != 0.0)
    return fail({.code = Errc::invalid_argument,
                 .where = "--train-fraction",
                 .what = "windows of one recording in training and test",
                 .hint = "Use --train-groups and --test-groups with --window-s"});
  return classifier::stratified_splits(features.labels, args.train_fraction, args.repeats,
                                       args.training.seed);
}

CLI::App* add_evaluate_command(const CommandGroup& group, CommandModality modality) {
  EvaluateArgs preset;
  preset.trials.modality = modality;
  return group.add<EvaluateArgs>("evaluate", run_evaluate, preset);
}

}  // namespace weft::daemon::cli
