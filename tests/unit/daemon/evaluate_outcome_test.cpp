// What `weft evaluate` measures, before it is shown.

#include "daemon/cli/evaluate_outcome.hpp"

#include "tests/unit/daemon/report_fixture.hpp"

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

TEST_CASE("an interval of groups left out says what it is, on the curve as well") {
  ChosenTrials chosen = chosen_trials();
  EvaluateArgs args = groups_left_out();
  args.curve = {2};
  const auto agreed = measure(args, chosen);
  if (!agreed) FAIL(to_string(agreed.error()));
  REQUIRE(agreed->outcomes[0].evaluation.deviation == 0);
  CHECK(agreed->outcomes[0].evaluation.ci95.method ==
        "Wilson score of one split, all splits agree");
  for (std::size_t row = 0; row < 3; ++row) chosen.features.labels[row] = "pile";  // some wrong
  const auto differing = measure(args, chosen);
  if (!differing) FAIL(to_string(differing.error()));
  REQUIRE(differing->outcomes[0].evaluation.deviation > 0);
  const std::string words = "Student t with the Nadeau-Bengio variance, over the groups left out";
  CHECK(differing->outcomes[0].evaluation.ci95.method == words);
  REQUIRE(differing->curve[0].values[0].deviation > 0);
  CHECK(differing->curve[0].values[0].ci95.method == words);
}

TEST_CASE("features are timed on whole trials, each by itself") {
  const ChosenTrials chosen = chosen_trials();
  double clock_s = 0, reads = 0;
  // reading number n finds the clock n seconds further on than the one before: 2, 4 ... 32 s
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

}  // namespace
}  // namespace weft::daemon::cli::evaluate_outcome_test
