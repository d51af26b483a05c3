#include "daemon/analysis/handover/train.hpp"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>
#include <set>

#include "daemon/analysis/tradeoff/measure_classifier.hpp"
#include "daemon/analysis/tradeoff/measure_vibro.hpp"
#include "daemon/analysis/tradeoff/tradeoff.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/document/confusion.hpp"
#include "daemon/pages/plot/interval_text.hpp"

namespace weft::daemon {
namespace {

namespace vibro = classifier::vibro;

constexpr double longest_window_s = 2;  // the window with which the paper continued [s]
constexpr double window_step_s = 1;
constexpr std::size_t windows_of_a_texture = 100;  // as in the paper
constexpr std::size_t fewest_at_random = 10;
constexpr std::size_t random_splits = 5;     // fewer show almost nothing of the spread
constexpr std::size_t tradeoff_windows = 2;  // 1 s and 2 s
constexpr std::size_t timed_windows = 31;

classifier::TrainOptions learner_options(const HandoverHooks& hooks, const StopRequested& stop) {
  return {.threads = hooks.threads, .stop = stop};
}

std::set<std::string> materials_in(const RecordingSet& set) {
  std::set<std::string> out;
  for (const vibro::Recording& r : set.recordings) out.insert(r.label);
  return out;
}

Result<ChosenLearner> choose_learner(const RecordingSet& set, const HandoverHooks& hooks,
                                     const StopRequested& stop) {
  vibro::ProtocolOptions protocol;
  protocol.protocol = vibro::Protocol::groups;
  protocol.window_s = longest_window_s;
  protocol.step_s = window_step_s;
  const auto windows =
      vibro::cut_and_extract(set.recordings, protocol.window_s, vibro::places_of(protocol),
                             {vibro::Family::wide, vibro::Combine::concat}, hooks.threads);
  if (!windows) return pass(windows.error());
  const auto splits = vibro::split_windows(*windows, protocol);
  if (!splits) return pass(splits.error());
  auto got = vibro::cross_validate(
      *windows, *splits,
      vibro::window_candidates(set.recordings.front().channels, vibro::Combine::concat),
      vibro::window_training(learner_options(hooks, stop), protocol.protocol), hooks.seconds_now);
  if (!got) return pass(got.error());
  name_left_out(*got, protocol.protocol);
  return ChosenLearner{protocol.window_s,      protocol.step_s,
                       windows->matrix.size(), windows->matrix.names.size(),
                       splits->size(),         std::move(*got)};
}

std::vector<classifier::Learner> learners_of_every() {
  std::vector<classifier::Learner> out = vibro::window_learners();
  std::erase_if(out, [](classifier::Learner one) { return !classifier::is_available(one); });
  return out;
}

Result<VibroTradeoff> compare_learners(const RecordingSet& set, const HandoverHooks& hooks,
                                       const StopRequested& stop,
                                       const std::function<void(const std::string&)>& announce) {
  VibroTradeoffOptions options;
  options.learners = learners_of_every();
  options.families = {vibro::Family::smmrpfft};
  options.sources = {list_sources(set).back()};  // all channels
  options.honest = vibro::Protocol::groups;
  options.protocol.step_s = window_step_s;
  const std::size_t of_each =
      std::max<std::size_t>(set.recordings.size() / materials_in(set).size(), 1);
  options.protocol.per_recording = std::max(fewest_at_random, windows_of_a_texture / of_each);
  options.protocol.repeats = random_splits;
  options.training = learner_options(hooks, stop);
  options.timings = timed_windows;
  const classifier::SecondsNow now =
      hooks.seconds_now ? hooks.seconds_now : classifier::SecondsNow([] { return 0.0; });
  return measure_vibro_tradeoff(
      set, options, now,
      [&](std::size_t, std::size_t, const std::string& what) { announce(what); });
}

using nlohmann::ordered_json;

constexpr std::size_t most_mistakes = 5;

std::string format_share(double share, const classifier::Interval& ci95) {
  return percent(share, 1) + " % (95 %: " + percent(ci95.low, 1) + " to " + percent(ci95.high, 1) +
         "; " + ci95.method + ")";
}

std::vector<std::string> chosen_in_turn(const vibro::CrossValidation& result) {
  std::vector<std::string> out;
  for (const classifier::Recipe& one : result.chosen)
    out.push_back(std::string(classifier::to_string(one.learner)) + " on " + one.features);
  return out;
}

ordered_json json_of_interval(const classifier::Interval& interval) {
  return {{"low", interval.low}, {"high", interval.high}, {"method", interval.method}};
}

ordered_json learner_json(const VibroPoint& p) {
  return {{"protocol", vibro::to_string(p.protocol)},
          {"window_s", p.window_s},
          {"features", vibro::to_string(p.family)},
          {"source", p.source},
          {"learner", classifier::to_string(p.learner)},
          {"f_score", p.result.f_score},
          {"f_score_ci95", json_of_interval(p.result.f_score_ci95)},
          {"windows_accuracy", p.result.accuracy},
          {"slides_accuracy", p.result.voted_accuracy},
          {"features_s", p.features_s},
          {"answer_s", p.result.answer_s},
          {"train_s", p.result.train_s}};
}

Blocks vibration_result(const std::string& exploration, const RecordingSet& set,
                        const VibrationTrainingResult& training_result) {
  const vibro::CrossValidation& r = training_result.best.result;
  const classifier::Confusion& confusion = r.confusion;
  const double chance = 1.0 / static_cast<double>(training_result.materials.size());
  const std::string badge = bench_badge(set.kind);
  return section(
      "Accuracy of sound and vibration",
      paragraph("<b>" + escape(exploration) + ": accuracy " +
                escape(format_share(r.voted_accuracy, r.voted_ci95)) +
                "</b> of slides, by majority vote of their windows; chance " + percent(chance) +
                " %. " + badge) +
          paragraph("Accuracy of single windows: " +
                    escape(format_share(r.accuracy, r.accuracy_ci95)) + ". " + badge) +
          figure(confusion_pictures(confusion,
                                    "Windows of " + general(training_result.best.window_s) + " s"),
                 "Confusion matrix of windows, cross-validated by group of repetitions. " +
                     escape(worst_confusions(confusion, most_mistakes)),
                 badge));
}

Blocks vibration_method(const RecordingSet& set, const VibrationTrainingResult& training_result) {
  const ChosenLearner& best = training_result.best;
  std::vector<std::string> channels;
  for (const vibro::Channel& c : set.recordings.front().channels)
    channels.push_back(c.name + " " + general(c.rate_hz) + " Hz [" + c.unit + "]");
  return figure(
      definitions(
          {{"data", std::to_string(set.recordings.size()) + " slides over " +
                        std::to_string(training_result.materials.size()) + " textures, phase M"},
           {"channels", joined(channels)},
           {"windows", thousands(best.windows) + " of " + general(best.window_s) +
                           " s, one every " + general(best.step_s) + " s, " +
                           std::to_string(best.columns) +
                           " features (WIDE; the learner chooses from its sets)"},
           {"split",
            "cross-validation over " + std::to_string(best.groups) + " groups of repetitions"},
           {"learner", "chosen without the tested group: " + joined(chosen_in_turn(best.result))},
           {"macro F-score of windows", fixed(best.result.f_score, 3)},
           {"model", "no model is saved; this page only evaluates"}}),
      "Windows, split and learner.", bench_badge(set.kind));
}

// Both protocols of "every": pictures, tables, and the paper's results.
Result<Blocks> compared_learners(const RecordingSet& set, const VibroTradeoff& tradeoff) {
  TradeoffReport report;
  report.measure = "macro F-score";
  report.costs = classifier_costs();
  report.costs.back().title = "window [s]";
  report.costs.back().words = "window";
  for (const vibro::Protocol protocol : {vibro::Protocol::random, tradeoff.honest})
    report.sets.push_back(vibro_tradeoff_set(tradeoff, set, set.name, protocol));
  auto sections = tradeoff_sections(report);
  if (!sections) return sections;
  return section("Macro F-score against time",
                 paragraph("The learners of the paper and of Weft on the paper's features: "
                           "SMMRPFFT, mean over the channels, three principal components. The "
                           "paper splits windows at random; the overlap of test and training "
                           "windows is measured below. Whole recordings do not overlap.")) +
         *sections;
}

}  // namespace

Result<RecordingSet> vibration_material(const Dataset& dataset, const std::string& exploration,
                                        const std::vector<std::size_t>& group_of) {
  auto set = extract_recordings(dataset, exploration);
  if (!set) return pass(set.error());
  for (vibro::Recording& recording : set->recordings) {
    std::size_t repetition = 0;
    const std::string& text = recording.group;
    std::from_chars(text.data(), text.data() + text.size(), repetition);
    recording.group = std::to_string(group_of.at(repetition - 1) + 1);
  }
  return set;
}

std::size_t vibration_steps(const recipes::Handover& wanted) {
  constexpr std::size_t protocols = 2;
  return 1 + (wanted.learner == "every" ? protocols * tradeoff_windows : 0);
}

Result<VibrationTrainingResult> train_vibration(
    const RecordingSet& set, const recipes::Handover& wanted, const HandoverHooks& hooks,
    const StopRequested& stop, const std::function<void(const std::string&)>& announce) {
  announce("windows of " + std::to_string(set.recordings.size()) +
           " slides, learner chosen without the tested group of repetitions");
  auto best = choose_learner(set, hooks, stop);
  if (!best) return pass(best.error());
  const auto labels = materials_in(set);
  VibrationTrainingResult out{std::move(*best), {}, {labels.begin(), labels.end()}};
  if (wanted.learner != "every") return out;
  auto tradeoff = compare_learners(set, hooks, stop, announce);
  if (!tradeoff) return pass(tradeoff.error());
  out.tradeoff = std::move(*tradeoff);
  return out;
}

HandoverEvaluation make_evaluation(const std::string& exploration, const std::string& file,
                                   const RecordingSet& set,
                                   const VibrationTrainingResult& training_result) {
  const vibro::CrossValidation& r = training_result.best.result;
  const auto in_turn = chosen_in_turn(r);
  const std::set<std::string> chosen(in_turn.begin(), in_turn.end());
  return {exploration,
          file,
          joined(chosen),
          training_result.best.window_s,
          set.recordings.size(),
          training_result.materials.size(),
          {r.accuracy, r.accuracy_ci95.low, r.accuracy_ci95.high},
          {r.voted_accuracy, r.voted_ci95.low, r.voted_ci95.high}};
}

ordered_json vibration_json(const RecordingSet& set,
                            const VibrationTrainingResult& training_result) {
  const ChosenLearner& best = training_result.best;
  const vibro::CrossValidation& r = best.result;
  ordered_json channels = ordered_json::array(), points = ordered_json::array();
  for (const vibro::Channel& c : set.recordings.front().channels)
    channels.push_back({{"name", c.name}, {"rate_hz", c.rate_hz}, {"unit", c.unit}});
  for (const VibroPoint& p : training_result.tradeoff.points) points.push_back(learner_json(p));
  return {{"bench", to_string(set.kind)},
          {"recordings", set.recordings.size()},
          {"channels", channels},
          {"materials", training_result.materials},
          {"chance", 1.0 / static_cast<double>(training_result.materials.size())},
          {"best",
           {{"protocol", "groups"},
            {"groups", best.groups},
            {"features", "WIDE"},
            {"combine", "concat"},
            {"window_s", best.window_s},
            {"step_s", best.step_s},
            {"windows", best.windows},
            {"columns", best.columns},
            {"chosen", chosen_in_turn(r)},
            {"windows_accuracy", r.accuracy},
            {"windows_ci95", json_of_interval(r.accuracy_ci95)},
            {"slides_accuracy", r.voted_accuracy},
            {"slides_ci95", json_of_interval(r.voted_ci95)},
            {"f_score", r.f_score},
            {"labels", r.confusion.labels},
            {"confusion", r.confusion.count}}},
          {"random_leak", training_result.tradeoff.random_leak.median},
          {"points", points}};
}

Result<Document> vibration_document(const std::string& exploration, const RecordingSet& set,
                                    const VibrationTrainingResult& training_result) {
  Document out{"vibration", "Sound and vibration of " + set.name + ", " + exploration,
               std::string(bench_text(set.kind))};
  out.result = vibration_result(exploration, set, training_result);
  if (!training_result.tradeoff.points.empty()) {
    auto compared = compared_learners(set, training_result.tradeoff);
    if (!compared) return pass(compared.error());
    out.pictures = std::move(*compared);
    out.tables = section("The paper's tables",
                         vibro_tables(training_result.tradeoff, bench_badge(set.kind)));
  }
  out.method = vibration_method(set, training_result);
  return out;
}

}  // namespace weft::daemon
