#include "daemon/apps/weft/evaluate_recordings.hpp"

#include <nlohmann/json.hpp>
#include <ostream>
#include <ranges>

#include "classifier/learners/training_cost.hpp"
#include "classifier/vibro/cross_validation.hpp"
#include "daemon/analysis/tradeoff/measure_vibro.hpp"
#include "daemon/analysis/tradeoff/vibro_paper.hpp"
#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/apps/weft/evaluate_outcome.hpp"
#include "daemon/apps/weft/evaluate_text.hpp"
#include "daemon/apps/weft/options.hpp"
#include "daemon/apps/weft/page_files.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/interval_text.hpp"
#include "daemon/storage/recordings/recording_set.hpp"

namespace weft::daemon::cli {
namespace {

namespace vibro = classifier::vibro;
using classifier::Learner;
using nlohmann::json;

struct RecordingsPlan {
  vibro::FeatureChoice features;
  /// best chooses among sets of features: windows have the columns of all of them (WIDE), and named
  /// learners use those of `features`.
  bool chooses_features = false;
  vibro::ProtocolOptions protocol;
  std::size_t components = 0;
  classifier::TrainOptions training;
  std::vector<Learner> learners;
  bool best = false;
};

/// Features to extract from windows.
vibro::FeatureChoice extracted_features(const RecordingsPlan& plan) {
  return {plan.chooses_features ? vibro::Family::wide : plan.features.family,
          plan.features.combine};
}

Status choose_learners(const RecordingChoice& choice, CommandModality modality,
                       RecordingsPlan& plan) {
  for (const std::string& word : choice.methods) {
    if (word == "best") {
      plan.best = true;
    } else if (word == "every") {
      plan.learners = vibro::window_learners();
      plan.best = true;
    } else if (const auto learner = classifier::single_learner_from(word)) {
      plan.learners.push_back(*learner);
    } else {
      return pass(learner.error(), name_in(modality, "--method"));
    }
  }
  plan.best = plan.best || choice.methods.empty();
  return {};
}

DataKind kind_of(vibro::Protocol protocol) {
  switch (protocol) {
    case vibro::Protocol::random:
      return DataKind::random_windows;
    case vibro::Protocol::blocks:
      return DataKind::parts;
    case vibro::Protocol::groups:
      return DataKind::whole_recordings;
  }
  return DataKind::whole_recordings;
}

Result<RecordingsPlan> make_plan(const EvaluateArgs& args) {
  const RecordingChoice& choice = args.recordings;
  RecordingsPlan out;
  const auto features = parse_feature_choice(choice);
  if (!features) return pass(features.error());
  const auto protocol = vibro::protocol_from(choice.protocol);
  if (!protocol) return pass(protocol.error(), "--protocol");
  out.features = *features;
  const bool by_group = !args.test_groups.empty() || args.leave_one_group_out;
  out.protocol.protocol = by_group ? vibro::Protocol::groups : *protocol;
  if (auto ok = check_command(args.trials, kind_of(out.protocol.protocol)); !ok)
    return pass(ok.error(), args.dataset.string());
  if (args.trials.window_s > 0.0) out.protocol.window_s = args.trials.window_s;
  out.protocol.step_s = choice.step_s;
  out.protocol.blocks = choice.blocks;
  out.protocol.per_recording = choice.per_recording;
  out.protocol.repeats = out.protocol.protocol == vibro::Protocol::random ? args.repeats : 1;
  out.protocol.train_groups = args.train_groups;
  out.protocol.test_groups = args.test_groups;
  out.protocol.seed = args.training.seed;
  out.components = choice.components;
  out.training = vibro::window_training({.seed = args.training.seed,
                                         .threads = args.training.threads,
                                         .outliers = choice.outliers,
                                         .budget = args.training.time_budget_s},
                                        out.protocol.protocol);
  if (auto ok = choose_learners(choice, args.trials.modality, out); !ok) return pass(ok.error());
  out.chooses_features = out.best && choice.features.empty() && choice.importance == 0;
  return out;
}

std::string format_split(const vibro::ProtocolOptions& p) {
  const std::string windows = general(p.window_s) + " s windows";
  if (p.protocol == vibro::Protocol::random)
    return windows + ", " + std::to_string(p.per_recording) + " at random from each recording, " +
           percent(p.test_share, 0) + " % of them for testing (the paper's protocol)";
  const std::string every = windows + " every " + general(p.step_s) + " s";
  if (p.protocol == vibro::Protocol::groups && p.test_groups.empty())
    return every + ", cross-validation over groups of whole recordings";
  if (p.protocol == vibro::Protocol::groups)
    return every + ", tested on the recordings of groups " + joined(p.test_groups, ",");
  return every + ", " + std::to_string(p.blocks) +
         " contiguous parts of each recording, cross-validated";
}

std::string format_plan(const RecordingsPlan& plan) {
  return format_split(plan.protocol) + format_outliers(plan.training.outliers);
}

std::size_t parts_of(const RecordingsPlan& plan) {
  return plan.protocol.protocol == vibro::Protocol::blocks ? plan.protocol.blocks : 1;
}

std::string format_leak(const vibro::Leak& leak, const classifier::DuplicateRows& duplicates) {
  std::string out;
  if (leak.largest > 0.0) out += "LEAK: " + leak_sentence(leak) + "; the accuracy is too high.\n";
  if (duplicates.found > 0) out += "LEAK: " + format_duplicates(duplicates, "windows") + ".\n";
  return out.empty() ? "Test windows and training windows share no samples.\n" : out;
}

json interval_json(const classifier::Interval& interval) {
  return {{"low", interval.low}, {"high", interval.high}, {"method", interval.method}};
}

json method_json(const vibro::CrossValidation& a) {
  json chosen = json::array(), features = json::array();
  for (const classifier::Recipe& one : a.chosen) {
    chosen.push_back(classifier::to_string(one.learner));
    if (!one.features.empty()) features.push_back(one.features);
  }
  return {
      {"accuracy", a.accuracy},
      {"accuracy_of_splits", a.split_accuracy},
      {"balanced_accuracy", a.confusion.balanced_accuracy()},
      {"f_score", a.f_score},
      {"recordings_accuracy", a.voted_accuracy},
      {"recordings_tested", a.voted},
      {"recordings_answers", a.voted_answers},
      {"windows_tested", a.confusion.total()},
      {"components", a.components},
      {"explained", a.explained},
      {"outliers", a.outliers},
      {"train_s", a.train_s},
      {"answer_s", a.answer_s},
      {"labels", a.confusion.labels},
      {"confusion", a.confusion.count},
      {"chosen", chosen},
      {"candidates", candidates_json(a.candidates.empty() ? std::vector<classifier::RecipeScore>{}
                                                          : a.candidates.front())},
      {"chosen_features", features},
      {"accuracy_ci95", interval_json(a.accuracy_ci95)},
      {"recordings_ci95", interval_json(a.voted_ci95)}};
}

std::vector<std::string> method_row(const std::string& name, const vibro::CrossValidation& a) {
  std::vector<std::string> chosen;
  for (const classifier::Recipe& one : a.chosen) chosen.push_back(format_chosen(one));
  // A choice that is equal in all splits is printed once.
  if (std::ranges::adjacent_find(chosen, std::ranges::not_equal_to()) == chosen.end() &&
      !chosen.empty())
    chosen.resize(1);
  return {name,
          percent(a.accuracy, 2),
          percent(a.accuracy_ci95.low, 0) + " to " + percent(a.accuracy_ci95.high, 0),
          fixed(a.f_score, 3),
          percent(a.voted_accuracy, 2) + " of " + std::to_string(a.voted),
          duration(a.train_s),
          duration(a.answer_s),
          joined(chosen)};
}

// Adds the result of one learner.
void add_method(const std::string& name, const RecordingsPlan& plan, vibro::CrossValidation got,
                Table& table, json& results, std::vector<WindowLearner>& all) {
  name_left_out(got, plan.protocol.protocol);
  table.row(method_row(name, got));
  results[name] = method_json(got);
  all.push_back({name, std::move(got)});
}

// Fills table, results and `all`. Learners without their library in this build are left out by
// name.
Status measure_all(const RecordingsPlan& plan, const std::vector<vibro::Channel>& channels,
                   const vibro::WindowSet& windows, const std::vector<classifier::Split>& splits,
                   Table& table, json& results, std::vector<WindowLearner>& all, Console& console) {
  for (const Learner learner : plan.learners) {
    const std::string name(classifier::to_string(learner));
    if (!classifier::is_available(learner) && plan.learners.size() > 1) {
      console.err << name << ": left out; this build of Weft lacks its library" << std::endl;
      continue;
    }
    const classifier::Recipe recipe =
        plan.chooses_features
            ? vibro::window_recipe(learner, plan.components, channels, plan.features)
            : vibro::window_recipe(learner, plan.components);
    auto got = vibro::cross_validate(windows, splits, std::span(&recipe, 1), plan.training,
                                     steady_wall_seconds);
    if (!got) return pass(got.error());
    add_method(name, plan, std::move(*got), table, results, all);
  }
  if (!plan.best) return {};
  const std::vector<classifier::Recipe> tried =
      plan.chooses_features
          ? vibro::window_candidates(channels, plan.features.combine, plan.components)
          : vibro::window_candidates(plan.components);
  auto got = vibro::cross_validate(windows, splits, tried, plan.training, steady_wall_seconds);
  if (!got) return pass(got.error());
  add_method("best", plan, std::move(*got), table, results, all);
  return {};
}

// Windows removed as outliers for each learner, over all splits; empty without --outliers.
std::string format_left_out(double deviations, const std::vector<WindowLearner>& learners) {
  std::string out;
  for (const WindowLearner& one : learners)
    if (deviations > 0.0)
      out += "  " + one.name + format_outliers(deviations, one.result.outliers) + "\n";
  return out;
}

// The variance that the paper's components explain, if its recipe was requested.
std::optional<double> explained_by_paper(const RecordingsPlan& plan, const RecordingSet& set) {
  if (plan.chooses_features ||
      !is_papers_recipe(set.recordings, plan.protocol, plan.features.combine, plan.components))
    return std::nullopt;
  return papers_explained(plan.features.family, plan.protocol.window_s);
}

// Learners of the same features have the same components, which are printed once.
std::string format_explained(const std::vector<WindowLearner>& learners,
                             std::optional<double> papers) {
  std::string out;
  double last = 0.0;
  for (const WindowLearner& one : learners) {
    if (one.result.components == 0 || one.result.explained == last) continue;
    last = one.result.explained;
    out += "  " + one.name + ": " + std::to_string(one.result.components) + " components explain " +
           percent(last, 2) + " % of the variance of training windows" +
           (papers ? " (the paper: " + percent(*papers, 0) + " %)" : "") + "\n";
  }
  return out;
}

// With --importance: for the single named learner, or else for the paper's forest.
Result<std::string> weigh(const EvaluateArgs& args, const RecordingsPlan& plan,
                          const vibro::WindowSet& windows,
                          const std::vector<classifier::Split>& splits, json& out) {
  if (args.recordings.importance == 0) return std::string();
  const Learner learner = plan.learners.size() == 1 ? plan.learners.front() : Learner::forest;
  return add_importance(windows, splits, vibro::window_recipe(learner, plan.components),
                        plan.training, args.recordings.importance, out);
}

}  // namespace

bool is_about_recordings(const TrialChoice& choice, const std::filesystem::path& file,
                         bool is_requested) {
  if (choice.modality) return choice.modality == classifier::Modality::vibro;
  return is_requested || is_recordings_file(file);
}

namespace {

json leak_json(const vibro::Leak& leak) {
  return {{"median_share", leak.median},
          {"largest_share", leak.largest},
          {"share_of_windows", leak.windows}};
}

/// The windows of a set, their splits, and the time of extraction.
struct Windows {
  vibro::WindowSet set;
  std::vector<classifier::Split> splits;
  vibro::Leak leak;
  std::vector<classifier::NeverTested> never_tested;  ///< labels that no recording tests
  classifier::DuplicateRows duplicates;               ///< test windows copied from training windows
  double features_s_each = 0;                         ///< median, vibro_features_time() [s]
};

constexpr std::size_t features_timed = 101;  // windows of the median

Result<Windows> cut_windows(const RecordingSet& set, const RecordingsPlan& plan) {
  vibro::ProtocolOptions protocol = plan.protocol;
  for (const std::vector<std::string>& names : copies_in(set))
    for (const std::string& copy : names) protocol.drawn_as[copy] = names.front();
  auto windows = vibro::cut_and_extract(set.recordings, protocol.window_s,
                                        vibro::places_of(protocol), extracted_features(plan));
  if (!windows) return pass(windows.error());
  auto splits = vibro::split_windows(*windows, plan.protocol);
  if (!splits) return pass(splits.error());
  const vibro::Leak leak = vibro::measure_leak(*windows, *splits);
  const auto each_s = vibro_features_time(set.recordings, *windows, extracted_features(plan),
                                          features_timed, steady_wall_seconds);
  if (!each_s) return pass(each_s.error());
  const classifier::FeatureMatrix& matrix = windows->matrix;
  auto never = classifier::never_tested(*splits, matrix.labels, matrix.groups, matrix.files);
  classifier::DuplicateRows duplicates = classifier::find_duplicates(matrix, *splits);
  return Windows{std::move(*windows), std::move(*splits),    leak,
                 std::move(never),    std::move(duplicates), *each_s};
}

Status write_page(const EvaluateArgs& args, const RecordingsPlan& plan, const RecordingSet& set,
                  const std::string& sha256, const Windows& windows, const std::string& what,
                  std::vector<WindowLearner> measured, const std::string& weighed,
                  const json& record) {
  std::vector<std::pair<std::string, std::string>> facts = {
      {"data", what},
      {"protocol", format_plan(plan)},
      {"leak", format_leak(windows.leak, windows.duplicates)}};
  if (!windows.set.too_short.empty())
    facts.emplace_back("left out", format_too_short(windows.set.too_short, parts_of(plan)));
  if (!windows.never_tested.empty())
    facts.emplace_back("never tested", format_never_tested(windows.never_tested, "recordings"));
  for (const Warning& warning : find_data_warnings(set))
    facts.emplace_back("WARNING", warning.text);
  const auto page = vibro_document({set.kind, args.dataset.filename().string(), sha256,
                                    std::move(facts), plan.protocol.window_s,
                                    windows.features_s_each, std::move(measured), weighed});
  if (!page) return pass(page.error());
  return write_page_files(args.report, record, *page);
}

/// Candidates that the time budget excluded in the first split; empty if there are none.
std::string format_untried(const std::vector<WindowLearner>& measured) {
  std::string out;
  for (const WindowLearner& one : measured)
    for (const auto& scores : one.result.candidates | std::views::take(1))
      if (const std::string text = classifier::format_skipped(scores); !text.empty())
        out += one.name + ": " + text + "\n";
  return out;
}

/// Warnings above the table, a line each.
std::string format_warnings(const RecordingsPlan& plan, const Windows& windows) {
  std::string out;
  if (!windows.set.too_short.empty())
    out += format_too_short(windows.set.too_short, parts_of(plan)) + "\n";
  if (!windows.never_tested.empty())
    out += "never tested: " + format_never_tested(windows.never_tested, "recordings") + "\n";
  return out + format_leak(windows.leak, windows.duplicates);
}

}  // namespace

Result<int> run_evaluate_recordings(const EvaluateArgs& args, Console& console) {
  if (!args.report.empty())
    if (Status ok = check_page(args.dataset, args.report); !ok) return pass(ok.error());
  auto set = open_recordings(args.dataset, args.trials.exploration, false);
  if (!set) return pass(set.error());
  const std::string sha256 = recordings_sha256(*set);
  if (auto ok = set_groups(*set, args.trials.group); !ok)
    return pass(ok.error(), args.dataset.string());
  const auto plan = make_plan(args);
  if (!plan) return pass(plan.error());
  const auto windows = cut_windows(*set, *plan);
  if (!windows) return pass(windows.error(), args.dataset.string());
  const classifier::FeatureMatrix& matrix = windows->set.matrix;
  Table table;
  table.row({"learner", "windows %", "95 %", "F-score", "recordings %", "training", "prediction",
             "chosen"});
  json results = json::object(), importance;
  std::vector<WindowLearner> measured;
  if (auto ok = measure_all(*plan, set->recordings.front().channels, windows->set, windows->splits,
                            table, results, measured, console);
      !ok)
    return pass(ok.error(), args.dataset.string());
  const auto weighed = weigh(args, *plan, windows->set, windows->splits, importance);
  if (!weighed) return pass(weighed.error(), args.dataset.string());
  const std::optional<double> papers = explained_by_paper(*plan, *set);
  const std::string columns = std::to_string(matrix.names.size());
  const std::vector<vibro::TooShort>& too_short = windows->set.too_short;
  const std::string what = std::to_string(set->recordings.size() - too_short.size()) +
                           " recordings, " + thousands(matrix.size()) + " windows, " + columns +
                           " columns of " +
                           std::string(vibro::to_string(extracted_features(*plan).family));
  const std::vector<Warning> warnings = find_data_warnings(*set);
  // Zero if this build has no library for any of the learners.
  const double base_rate = measured.empty() ? 0.0 : measured.front().result.confusion.base_rate();
  const std::string balance =
      measured.empty() ? ""
                       : "windows: " + format_balance(measured.front().result.confusion) + "\n";
  const std::string text = bench_banner(set->kind) + args.dataset.string() + " (" +
                           std::string(to_string(set->kind)) + "): " + what + "\n" +
                           format_plan(*plan) + "\n" + warnings_text(warnings) +
                           format_warnings(*plan, *windows) + balance + table.text() +
                           format_untried(measured) + format_explained(measured, papers) +
                           format_left_out(plan->training.outliers, measured) + *weighed;
  const json record = {{"command", "evaluate"},
                       {"kind", "recordings"},
                       {"exploration", args.trials.exploration},
                       {"dataset", args.dataset.string()},
                       {"dataset_sha256", sha256},
                       {"bench", to_string(set->kind)},
                       {"protocol", vibro::to_string(plan->protocol.protocol)},
                       {"protocol_words", format_plan(*plan)},
                       {"window_s", plan->protocol.window_s},
                       {"leak", leak_json(windows->leak)},
                       {"twins", duplicates_json(windows->duplicates)},
                       {"never_tested", never_tested_json(windows->never_tested)},
                       {"warnings", warnings},
                       {"features", vibro::to_string(extracted_features(*plan).family)},
                       {"combine", vibro::to_string(plan->features.combine)},
                       {"components", plan->components},
                       {"outliers", plan->training.outliers},
                       {"columns", matrix.names},
                       {"windows", matrix.size()},
                       {"base_rate", base_rate},
                       {"too_short", too_short_json(too_short)},
                       {"features_s_per_window", windows->features_s_each},
                       {"importance", importance},
                       {"paper", papers ? json{{"explained", *papers}} : json()},
                       {"results", results}};
  if (!args.report.empty())
    if (Status ok = write_page(args, *plan, *set, sha256, *windows, what, std::move(measured),
                               *weighed, record);
        !ok)
      return pass(ok.error());
  print(console, text, record);
  return exit_ok;
}

}  // namespace weft::daemon::cli
