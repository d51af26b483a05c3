// What is told of a hand-over from vibration: figures as JSON, and a page.

#include <nlohmann/json.hpp>

#include "daemon/analysis/handover/train_vibration.hpp"
#include "daemon/analysis/tradeoff/measure_classifier.hpp"
#include "daemon/analysis/tradeoff/tradeoff_page.hpp"
#include "daemon/analysis/tradeoff/vibro_evaluation_page.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/pages/plot/html.hpp"
#include "daemon/pages/plot/scatter.hpp"

namespace weft::daemon {
namespace {

namespace vibro = classifier::vibro;
using nlohmann::ordered_json;

constexpr std::size_t most_mistakes = 5;

std::string format_share(double share, const classifier::Interval& ci95) {
  return percent(share, 1) + " % (95 %: " + percent(ci95.low, 1) + " to " + percent(ci95.high, 1) +
         "; " + ci95.method + ")";
}

std::string chosen_in_turn(const vibro::CrossValidation& result) {
  std::vector<std::string> out;
  for (const vibro::Method method : result.chosen) out.emplace_back(vibro::to_string(method));
  return joined(out);
}

ordered_json json_of_interval(const classifier::Interval& interval) {
  return {{"low", interval.low}, {"high", interval.high}, {"method", interval.method}};
}

ordered_json learner_json(const VibroPoint& p) {
  return {{"protocol", vibro::to_string(p.protocol)},
          {"window_s", p.window_s},
          {"features", vibro::to_string(p.family)},
          {"source", p.source},
          {"learner", vibro::to_string(p.method)},
          {"f_score", p.result.f_score},
          {"f_score_ci95", json_of_interval(p.result.f_score_ci95)},
          {"windows_accuracy", p.result.accuracy},
          {"slides_accuracy", p.result.voted_accuracy},
          {"features_s", p.features_s},
          {"answer_s", p.result.answer_s},
          {"train_s", p.result.train_s}};
}

std::string vibration_heading(const std::string& exploration, const RecordingSet& set,
                              const VibrationTrainingResult& training_result) {
  const ChosenLearner& best = training_result.best;
  const vibro::CrossValidation& r = best.result;
  std::vector<std::string> channels;
  for (const vibro::Channel& c : set.recordings.front().channels)
    channels.push_back(c.name + " " + general(c.rate_hz) + " Hz [" + c.unit + "]");
  return "<header>" + bench_badge(set.kind) + "\n<h1>Sound and vibration of " + escape(set.name) +
         ", " + escape(exploration) + "</h1>\n</header>\n<dl>" +
         definition("data", std::to_string(set.recordings.size()) + " slides over " +
                                std::to_string(training_result.materials.size()) +
                                " textures, phase M") +
         definition("channels", joined(channels)) +
         definition("windows", thousands(best.windows) + " of " + general(best.window_s) +
                                   " s, one every " + general(best.step_s) + " s, " +
                                   std::to_string(best.columns) + " features (SMMRPFFT)") +
         definition("split", "each of " + std::to_string(best.groups) +
                                 " groups of repetitions left out in turn") +
         definition("learner", "chosen without the group: " + chosen_in_turn(r)) +
         definition("windows right", format_share(r.accuracy, r.accuracy_ci95)) +
         definition("slides right, by the most frequent answer of their windows",
                    format_share(r.voted_accuracy, r.voted_ci95)) +
         definition("macro F-score of windows", fixed(r.f_score, 3)) +
         definition(
             "chance",
             percent(1.0 / static_cast<double>(training_result.materials.size()), 1) + " %") +
         definition("model", "none is kept: this evaluates") + "</dl>\n";
}

std::string by_material(const RecordingSet& set, const ChosenLearner& best) {
  const classifier::Confusion& confusion = best.result.confusion;
  return "<section>\n<h2>Confusion by material</h2>\n" +
         figure("<div class=\"scroll\">" +
                    confusion_map(confusion, "Windows of " + general(best.window_s) + " s") +
                    "</div>",
                "The chosen learner on repetitions left out. " +
                    escape(worst_confusions(confusion, most_mistakes)),
                bench_badge(set.kind)) +
         "</section>\n";
}

// Both protocols of "every": pictures, tables, and what the paper had.
Result<std::string> compared_learners(const RecordingSet& set, const VibroTradeoff& tradeoff) {
  TradeoffReport report;
  report.costs = classifier_costs();
  report.costs.back().title = "window [s]";
  report.costs.back().words = "window";
  for (const vibro::Protocol protocol : {vibro::Protocol::random, tradeoff.honest})
    report.sets.push_back(vibro_tradeoff_set(tradeoff, set, set.name, protocol));
  report.tables_html = "<section>\n<h2>The paper's tables</h2>\n" +
                       vibro_tables_html(tradeoff, bench_badge(set.kind)) + "</section>\n";
  auto sections = tradeoff_sections_html(report);
  if (!sections) return sections;
  return "<section>\n<h2>F-score against time</h2>\n<p>The learners of the paper and ours by its "
         "own features: SMMRPFFT, the mean over the channels, three principal components; accuracy "
         "is the macro F-score. Windows at random are its protocol: how much of a test window "
         "is in a training window too is measured below. Whole recordings share "
         "nothing.</p>\n</section>\n" +
         *sections;
}

}  // namespace

ordered_json vibration_json(const RecordingSet& set,
                            const VibrationTrainingResult& training_result) {
  const ChosenLearner& best = training_result.best;
  const vibro::CrossValidation& r = best.result;
  ordered_json channels = ordered_json::array(), chosen = ordered_json::array(),
               points = ordered_json::array();
  for (const vibro::Channel& c : set.recordings.front().channels)
    channels.push_back({{"name", c.name}, {"rate_hz", c.rate_hz}, {"unit", c.unit}});
  for (const vibro::Method method : r.chosen) chosen.push_back(vibro::to_string(method));
  for (const VibroPoint& p : training_result.tradeoff.points) points.push_back(learner_json(p));
  return {{"bench", to_string(set.kind)},
          {"recordings", set.recordings.size()},
          {"channels", channels},
          {"materials", training_result.materials},
          {"chance", 1.0 / static_cast<double>(training_result.materials.size())},
          {"best",
           {{"protocol", "groups"},
            {"groups", best.groups},
            {"features", "SMMRPFFT"},
            {"combine", "concat"},
            {"window_s", best.window_s},
            {"step_s", best.step_s},
            {"windows", best.windows},
            {"columns", best.columns},
            {"chosen", chosen},
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

Result<std::string> vibration_html(const std::string& exploration, const RecordingSet& set,
                                   const VibrationTrainingResult& training_result) {
  std::string out =
      vibration_heading(exploration, set, training_result) + by_material(set, training_result.best);
  if (!training_result.tradeoff.points.empty()) {
    const auto compared = compared_learners(set, training_result.tradeoff);
    if (!compared) return compared;
    out += *compared;
  }
  return page_around("Sound and vibration of " + set.name, out);
}

}  // namespace weft::daemon
