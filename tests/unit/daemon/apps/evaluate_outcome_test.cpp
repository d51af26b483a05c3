// The measurements of `weft evaluate`, before they are shown.

#include "daemon/apps/weft/evaluate_outcome.hpp"

#include <nlohmann/json.hpp>

#include "daemon/apps/weft/evaluate_text.hpp"
#include "tests/unit/daemon/analysis/report_fixture.hpp"

namespace weft::daemon::cli::evaluate_outcome_test {
namespace {

ChosenTrials chosen_trials() {
  ChosenTrials out;
  out.dataset = report_test::small_campaign(6);
  out.dataset.info.taxel_rate_hz = 37;
  for (std::size_t i = 0; i < out.dataset.trials.size(); ++i)
    out.dataset.trials[i].group = i / 9 == 0 ? "A" : "B";
  auto features = classifier::build_feature_matrix(complete_trials(out.dataset));
  REQUIRE(features);
  out.strokes = features->size();
  out.features = std::move(*features);
  out.setup.taxels = 4;
  return out;
}

EvaluateArgs groups_left_out() {
  EvaluateArgs out;
  out.learners = {"lda"};
  out.leave_one_group_out = true;
  return out;
}

TEST_CASE("a learning curve rises in trials and has each number once, however it was asked for") {
  const ChosenTrials chosen = chosen_trials();
  EvaluateArgs args = groups_left_out();
  args.curve = {3, 2, 3};
  args.curve_draws = 2;
  const auto measured = measure(args, chosen);
  if (!measured) FAIL(to_string(measured.error()));
  REQUIRE(measured->curve.size() == 2);
  CHECK(measured->curve[0].trials == 2);
  CHECK(measured->curve[1].trials == 3);
}

TEST_CASE("an interval of left-out groups names its method, on the curve as well") {
  ChosenTrials chosen = chosen_trials();
  EvaluateArgs args = groups_left_out();
  args.curve = {2};
  const auto agreed = measure(args, chosen);
  if (!agreed) FAIL(to_string(agreed.error()));
  REQUIRE(agreed->outcomes[0].evaluation.deviation == 0);
  CHECK(agreed->outcomes[0].evaluation.ci95.method == "Wilson score of 2 groups, all groups agree");
  // some predictions are wrong
  for (std::size_t row = 0; row < 3; ++row) chosen.features.labels[row] = "pile";
  const auto differing = measure(args, chosen);
  if (!differing) FAIL(to_string(differing.error()));
  REQUIRE(differing->outcomes[0].evaluation.deviation > 0);
  const std::string words = "Student t with the Nadeau-Bengio variance, over the groups left out";
  CHECK(differing->outcomes[0].evaluation.ci95.method == words);
  REQUIRE(differing->curve[0].values[0].deviation > 0);
  CHECK(differing->curve[0].values[0].ci95.method == words);
}

TEST_CASE(
    "draws of a learning curve are no groups and no splits: the interval is over the splits") {
  ChosenTrials chosen = chosen_trials();
  // some predictions are wrong
  for (std::size_t row = 0; row < 3; ++row) chosen.features.labels[row] = "pile";
  EvaluateArgs args = groups_left_out();
  args.curve = {2};
  args.curve_draws = 40;
  const auto measured = measure(args, chosen);
  if (!measured) FAIL(to_string(measured.error()));
  const CurvePoint& point = measured->curve[0];
  CHECK(point.draws == 2 * 40);
  const classifier::Interval& sure = point.values[0].ci95;
  CHECK(sure.method.find("over the groups left out") != std::string::npos);
  const auto drawn = classifier::thinned(measured->splits, chosen.features.labels,
                                         chosen.features.files, 2, 40, args.training.seed);
  REQUIRE(drawn);
  const auto each = classifier::evaluate(chosen.features, *drawn, classifier::Learner::lda,
                                         train_options(args.training));
  REQUIRE(each);
  std::vector<double> of_group(2);
  for (std::size_t i = 0; i < 80; ++i) of_group[i / 40] += each->splits[i].accuracy / 40;
  const auto expected = classifier::split_interval(of_group, mean_sizes(measured->splits));
  CHECK(sure.low == Approx(expected.low));
  CHECK(sure.high == Approx(expected.high));
  args.leave_one_group_out = false;
  args.train_groups = {"A"};
  args.test_groups = {"B"};
  const auto fixed = measure(args, chosen);
  if (!fixed) FAIL(to_string(fixed.error()));
  const CurveValue& value = fixed->curve[0].values[0];
  CHECK(value.deviation > 0);
  const auto requested = static_cast<double>(fixed->splits[0].test.size());
  CHECK(value.ci95.low == Approx(classifier::wilson_of_share(value.accuracy, requested).low));
  CHECK(value.ci95.method == classifier::wilson_interval(1, 2).method);
}

TEST_CASE("what can be known before a training is refused before it") {
  ChosenTrials chosen = chosen_trials();
  // training would be refused, so the message shows which check came first
  chosen.features.values.row(0)[0] = std::nan("");
  EvaluateArgs args = groups_left_out();
  CHECK(measure(args, chosen).error().where.find("--learning-curve") == std::string::npos);
  args.curve = {2, 31};
  CHECK(measure(args, chosen).error().where.find("--learning-curve") == 0);
  CHECK(measure(args, chosen).error().got == "31");
  args.curve.clear();
  args.none_of_these = true;
  for (std::string& label : chosen.features.labels)
    if (label == "pile") label = "wool";
  CHECK(measure(args, chosen).error().expected == "at least 3");
}

TEST_CASE("a label that is in one group alone is reported as never tested") {
  ChosenTrials chosen = chosen_trials();
  EvaluateArgs args = groups_left_out();
  const auto all = measure(args, chosen);
  if (!all) FAIL(to_string(all.error()));
  CHECK(all->never_tested.empty());
  for (std::size_t row = 0; row < 3; ++row) chosen.features.labels[row] = "silk";
  const auto measured = measure(args, chosen);
  if (!measured) FAIL(to_string(measured.error()));
  REQUIRE(measured->never_tested.size() == 1);
  CHECK(format_never_tested(measured->never_tested, "trials") ==
        "silk (3 trials, only in group A)");
  CHECK(report_text(args, chosen, *measured).find("silk (3 trials, only in group A)") !=
        std::string::npos);
  const nlohmann::json out = report_json(args, chosen, *measured);
  CHECK(out["never_tested"] ==
        nlohmann::json::array({{{"label", "silk"}, {"recordings", 3}, {"group", "A"}}}));
}

TEST_CASE("features are timed on whole trials, each by itself") {
  const ChosenTrials chosen = chosen_trials();
  double clock_s = 0, reads = 0;
  // reading number n is n seconds later than the one before: 2, 4 ... 32 s
  const auto now = [&] { return clock_s += ++reads; };
  CHECK(seconds_of_features({}, chosen, now) == Approx(17));
  CHECK(reads == 2 * 16);
  TrialChoice windows;
  windows.window_s = 2;
  CHECK(seconds_of_features(windows, chosen, now) == 0);
  TrialChoice joined;
  joined.exploration = "M1+M2";
  CHECK(seconds_of_features(joined, chosen, now) == 0);
}

TEST_CASE("features are timed at the level that was asked for") {
  ChosenTrials chosen = chosen_trials();
  for (auto& trial : chosen.dataset.trials)
    std::ranges::replace(trial.phase, Phase::rest, Phase::press);
  TrialChoice no_rest;
  no_rest.remove_level = "rest";
  CHECK(seconds_of_features({}, chosen, [now = 0.0]() mutable { return now += 1; }) == 1);
  CHECK(seconds_of_features(no_rest, chosen, [] { return 0.0; }) == 0);
}

TEST_CASE("label and mounting are reported as confounded, with the accuracy without levels") {
  ChosenTrials chosen = chosen_trials();
  EvaluateArgs args = groups_left_out();
  const auto unknown = measure(args, chosen);
  if (!unknown) FAIL(to_string(unknown.error()));
  CHECK_FALSE(unknown->confounded);
  CHECK_FALSE(unknown->outcomes[0].level_removed);
  CHECK(report_json(args, chosen, *unknown).at("confounded").is_null());

  for (TrialRecord& record : chosen.dataset.records) record.spec.place.mounting = 1;
  const auto known = measure(args, chosen);
  if (!known) FAIL(to_string(known.error()));
  CHECK(known->confounded);
  REQUIRE(known->outcomes[0].level_removed);
  CHECK(known->outcomes[0].level_removed->splits.size() == 2);
  const auto json = report_json(args, chosen, *known);
  CHECK(json.at("confounded") == "mounting");
  CHECK(json.at("results").at("lda").at("level_removed").at("splits") == 2);
  CHECK(report_test::count_of(report_text(args, chosen, *known), "CONFOUNDED") == 1);

  args.trials.remove_level = "motion";  // the features are already without levels
  const auto removed = measure(args, chosen);
  if (!removed) FAIL(to_string(removed.error()));
  CHECK(removed->confounded);
  CHECK_FALSE(removed->outcomes[0].level_removed);
}

}  // namespace
}  // namespace weft::daemon::cli::evaluate_outcome_test
