// `weft tradeoff classifier`: the measured quantities.

#include <malloc.h>

#include <set>

#include "classifier/vote/vote.hpp"
#include "daemon/analysis/tradeoff/answer_timing.hpp"
#include "daemon/analysis/tradeoff/material.hpp"
#include "daemon/analysis/tradeoff/measure_classifier.hpp"
#include "daemon/pages/plot/interval_text.hpp"
#include "tests/unit/daemon/analysis/tradeoff_fixture.hpp"

namespace trade_measure_test {

using namespace weft;
using namespace weft::daemon;
using trade_test::campaign_set;
using trade_test::two_explorations;

namespace {

// Similar fabrics, with file names like those of fabricslide.
Dataset recorded_set() {
  Dataset set;
  set.info.kind = BenchKind::real;
  set.info.name = "recorded";
  set.info.source = "fabricslide";
  set.info.taxel_rate_hz = 37;
  std::mt19937 engine(11);
  for (std::uint32_t k = 1; k <= 8; ++k) {
    report_test::add_trial(set, "knitwear1", {3.0, 3}, k, engine);
    report_test::add_trial(set, "wool", {2.5, 3.1}, k, engine);
    report_test::add_trial(set, "pile", {2.8, 2.9}, k, engine);
  }
  for (std::size_t i = 0; i < set.trials.size(); ++i) {
    const bool fast = i / 3 % 2 == 0;
    set.trials[i].file =
        set.trials[i].label + (fast ? "_F120_V-50mmps_" : "_F120_V10mmps_") + std::to_string(i);
    set.trials[i].group = i / 3 < 4 ? "0" : "1";
    set.records[i].spec.exploration.clear();
  }
  return set;
}

Result<SplitPlan> random_splits(const classifier::FeatureMatrix& features) {
  auto splits = classifier::stratified_splits(features.labels, 0.5, 3, 1);
  if (!splits) return pass(splits.error());
  return SplitPlan{std::move(*splits), "three random splits"};
}

Result<SplitPlan> group_splits(const classifier::FeatureMatrix& features) {
  auto splits = classifier::leave_one_group_out(features.groups, features.labels);
  if (!splits) return pass(splits.error());
  return SplitPlan{std::move(*splits), "groups", true};
}

ClassifierTradeoffOptions options_for(std::vector<TradeoffFamily> vary, SplitMaker split) {
  ClassifierTradeoffOptions out;
  out.vary = std::move(vary);
  out.split = std::move(split);
  out.training.threads = 1;
  out.timings = 5;
  out.timed_trials = 4;
  return out;
}

// A clock that advances by a quarter of a second at each reading.
classifier::SecondsNow ticking() {
  return [now = std::make_shared<double>(0)] { return *now += 0.25; };
}

TradeoffSet measured(const Dataset& set, const ClassifierTradeoffOptions& options) {
  auto out = measure_classifier_tradeoff(set, options, ticking());
  if (!out) FAIL(to_string(out.error()));
  return std::move(*out);
}

const TradeoffPoint& named(const TradeoffSet& set, const std::string& name) {
  const auto found = std::find_if(set.points.begin(), set.points.end(),
                                  [&](const TradeoffPoint& p) { return p.name == name; });
  if (found == set.points.end()) FAIL("no point " + name);
  return *found;
}

double right_answers(const TradeoffPoint& p) {
  return p.accuracy * static_cast<double>(p.tested);
}

}  // namespace

TEST_CASE("the default is trained and tested as weft evaluate does it") {
  const Dataset set = recorded_set();
  auto options = options_for({TradeoffFamily::vote, TradeoffFamily::learner}, random_splits);
  const TradeoffSet tradeoff = measured(set, options);
  const auto matrix = classifier::build_feature_matrix(complete_trials(set));
  REQUIRE(matrix.has_value());
  const auto plan = random_splits(*matrix);
  REQUIRE(plan.has_value());
  for (const auto& [name, learner] : {std::pair{"default", classifier::Learner::pvalue},
                                      std::pair{"LDA", classifier::Learner::lda}}) {
    const auto expected = classifier::evaluate(*matrix, plan->splits, learner, options.training);
    REQUIRE(expected.has_value());
    const TradeoffPoint& got = named(tradeoff, name);
    CHECK(got.accuracy == Approx(expected->accuracy).epsilon(1e-12));
    CHECK(got.ci95.low == Approx(expected->ci95.low).epsilon(1e-12));
    CHECK(got.ci95.high == Approx(expected->ci95.high).epsilon(1e-12));
    CHECK(got.tested == expected->confusion.total());
  }
  CHECK(tradeoff.points.front().name == "default");
  CHECK(tradeoff.points.front().accuracy < 1.0);  // otherwise the comparison would show little
}

TEST_CASE("trials of the speeds add up to the default's, and each speed has its own seconds") {
  Dataset set = recorded_set();
  for (std::size_t i = 0; i < set.trials.size(); ++i)
    if (speed_in_name(set.trials[i].file) == 50.0) set.trials[i] = shortened(set.trials[i], 74);
  const TradeoffSet tradeoff = measured(set, options_for({TradeoffFamily::speed}, group_splits));
  REQUIRE(tradeoff.points.size() == 3);
  const TradeoffPoint& slow = named(tradeoff, "10 mm/s");
  const TradeoffPoint& fast = named(tradeoff, "50 mm/s");
  CHECK(slow.tested + fast.tested == tradeoff.points.front().tested);
  CHECK(right_answers(slow) + right_answers(fast) ==
        Approx(right_answers(tradeoff.points.front())).epsilon(1e-12));
  CHECK(fast.contact_s == Approx(2));
  CHECK(slow.contact_s == Approx(10).margin(1.0 / 37));
}

TEST_CASE("groups left out get the interval of weft evaluate, Wilson's where they all agree") {
  const Dataset set = recorded_set();
  const auto options = options_for({TradeoffFamily::learner}, group_splits);
  const TradeoffSet tradeoff = measured(set, options);
  const auto matrix = classifier::build_feature_matrix(complete_trials(set));
  REQUIRE(matrix.has_value());
  const auto plan = group_splits(*matrix);
  REQUIRE(plan.has_value());
  const auto expected =
      classifier::evaluate(*matrix, plan->splits, classifier::Learner::pvalue, options.training);
  REQUIRE(expected.has_value());
  const TradeoffPoint& p = tradeoff.points.front();
  CHECK(p.accuracy == Approx(expected->accuracy).epsilon(1e-12));
  CHECK(p.ci95.low == Approx(expected->ci95.low).epsilon(1e-12));
  CHECK(p.ci95.high == Approx(expected->ci95.high).epsilon(1e-12));
  const bool agree = expected->deviation == 0;
  CHECK(p.ci95.method ==
        (agree ? "Wilson score of one split, all splits agree"
               : "Student t with the Nadeau-Bengio variance, over the groups left out"));
}

TEST_CASE("only Student's interval is renamed for groups left out") {
  classifier::Interval student =
      classifier::split_interval(std::vector<double>{0.5, 0.75, 0.5}, {8, 4});
  classifier::Interval wilson =
      classifier::split_interval(std::vector<double>{0.5, 0.5, 0.5}, {8, 4});
  const std::string before = wilson.method;
  name_groups_left_out(student);
  name_groups_left_out(wilson);
  CHECK(student.method == "Student t with the Nadeau-Bengio variance, over the groups left out");
  CHECK(wilson.method == before);
}

TEST_CASE("intervals of sound and vibration state whether groups or parts were left out") {
  namespace vibro = classifier::vibro;
  const auto named = [](vibro::Protocol protocol) {
    vibro::CrossValidation out{classifier::Confusion({"a"})};
    out.accuracy_ci95 = out.f_score_ci95 =
        classifier::split_interval(std::vector<double>{0.5, 0.75, 0.5}, {8, 4});
    out.voted_ci95 = classifier::wilson_interval(3, 4);
    name_left_out(out, protocol);
    CHECK(out.f_score_ci95.method == out.accuracy_ci95.method);
    CHECK(out.voted_ci95.method == classifier::wilson_interval(3, 4).method);
    return out.accuracy_ci95.method;
  };
  CHECK(named(vibro::Protocol::groups).ends_with("over the groups left out"));
  CHECK(named(vibro::Protocol::blocks)
            .ends_with("over the contiguous parts of each recording left out"));
  CHECK(named(vibro::Protocol::random).ends_with("random splits of the same data"));
}

TEST_CASE("families are varied one at a time around the default") {
  const TradeoffSet tradeoff =
      measured(two_explorations(), options_for({TradeoffFamily::features, TradeoffFamily::slide,
                                                TradeoffFamily::exploration, TradeoffFamily::vote},
                                               random_splits));
  const auto names = [&](const std::string& family) {
    std::set<std::string> out;
    for (const TradeoffPoint& p : tradeoff.points)
      if (p.family == family) out.insert(p.name);
    return out;
  };
  CHECK(names("default") == std::set<std::string>{"default"});
  CHECK(names("features") == std::set<std::string>{"N 1", "N 2", "N 5", "N 10", "N 40", "N 51"});
  CHECK(names("slide") == std::set<std::string>{"0.5 s", "1 s", "2 s", "4 s", "8 s"});
  CHECK(names("exploration") == std::set<std::string>{"M2", "M1+M2"});
  CHECK(names("vote") == std::set<std::string>{"soft vote", "DAG", "short-list of 2"});
  CHECK(named(tradeoff, "M1+M2").contact_s == Approx(2 * named(tradeoff, "M2").contact_s));
  CHECK(named(tradeoff, "DAG").train_s == tradeoff.points.front().train_s);
  for (const TradeoffPoint& p : tradeoff.points) CHECK(p.bench == BenchKind::simulated);
}

TEST_CASE("an answer takes what its features and its vote take, each timed by itself") {
  const TradeoffSet tradeoff =
      measured(campaign_set(), options_for({TradeoffFamily::vote}, random_splits));
  for (const TradeoffPoint& p : tradeoff.points) {
    CHECK(p.timings_s == std::vector<double>(4, 0.5));  // two ticks for each of four trials
    CHECK(p.features_s == 0.25);
    CHECK(p.vote_s == 0.25);
    CHECK(p.answer_s == 0.5);
  }
}

TEST_CASE("answers that share trials share the figure for their features, and no warming counts") {
  const Dataset set = campaign_set(2);
  const auto trials = std::make_shared<std::vector<AnswerTrials>>();
  trials->push_back({set.trials[0]});
  std::size_t requested = 0;
  const AnswerFunction answer = [&](std::span<const double> features) -> Result<std::size_t> {
    CHECK(features.size() == 3 + 12 * 4);
    ++requested;
    return 0;
  };
  const std::vector<TimedAnswer> both(2, {trials, answer});
  // reading number n is n seconds later than the one before
  double clock_s = 0, reads = 0;
  const auto times = time_answers(both, 5, {}, [&] { return clock_s += ++reads; });
  REQUIRE(times.has_value());
  CHECK(requested == 2 * 6);
  // six readings a repetition, of which the second of each pair counts; the third of the five is
  // the median
  CHECK((*times)[0].features_s == std::vector<double>{3 * 6 + 2});
  CHECK((*times)[1].features_s == (*times)[0].features_s);
  CHECK((*times)[0].vote_s == std::vector<double>{3 * 6 + 4});
  CHECK((*times)[1].vote_s == std::vector<double>{3 * 6 + 6});
}

TEST_CASE("no table for a length of motion is made while features are timed") {
  // more lengths than an extractor has tables for
  const classifier::Trial whole = campaign_set(2).trials.front();
  const auto trials = std::make_shared<std::vector<AnswerTrials>>();
  for (std::size_t samples = 40; samples < 340; samples += 25)
    trials->push_back({shortened(whole, samples)});
  const TimedAnswer zero{trials, [](std::span<const double>) -> Result<std::size_t> { return 0; }};
  std::vector<std::size_t> heap_bytes;
  heap_bytes.reserve(10'000);
  const auto times = time_answers(std::span(&zero, 1), 5, {}, [&] {
    const auto heap = ::mallinfo2();
    heap_bytes.push_back(heap.uordblks + heap.hblkhd);
    return 0.0;
  });
  REQUIRE(times.has_value());
  REQUIRE(heap_bytes.size() == 6 * 4 * trials->size());
  std::size_t changed = 0;
  for (std::size_t i = 0; i < heap_bytes.size(); i += 2)
    changed += heap_bytes[i] == heap_bytes[i + 1] ? 0 : 1;
  CHECK(changed <= trials->size());  // rows of the first repetition, which does not count
}

TEST_CASE("slides are cut up to the longest single one, however many are joined") {
  auto options = options_for({TradeoffFamily::slide}, random_splits);
  options.exploration = "M1+M2";
  const TradeoffSet tradeoff = measured(two_explorations(), options);
  std::vector<std::string> names;
  for (const TradeoffPoint& p : tradeoff.points) names.push_back(p.name);
  // 10 s each: 16 s would not shorten them, although both together last 20 s
  CHECK(names == std::vector<std::string>{"default", "0.5 s", "1 s", "2 s", "4 s", "8 s"});
  CHECK(named(tradeoff, "8 s").contact_s == Approx(16).margin(2.0 / 37));
}

TEST_CASE("the cores that a choice came to vote, on features as they take them") {
  const Dataset set = recorded_set();
  auto options = options_for({TradeoffFamily::vote, TradeoffFamily::features}, random_splits);
  options.learner = classifier::Learner::cores_best;
  const TradeoffSet tradeoff = measured(set, options);
  const auto matrix = classifier::build_feature_matrix(complete_trials(set));
  REQUIRE(matrix.has_value());
  const auto plan = random_splits(*matrix);
  std::size_t right = 0;
  for (const classifier::Split& split : plan->splits) {
    const auto rows = classifier::select_rows(*matrix, split.train);
    const auto chosen = classifier::train_learner(rows, options.learner, options.training);
    REQUIRE(chosen.has_value());
    const auto profile =
        classifier::fit_profile(chosen->trained.prepared(rows), chosen->trained.labels());
    REQUIRE(profile.has_value());
    for (const std::size_t row : split.test) {
      const auto features = chosen->trained.prepared(matrix->values.row(row));
      const auto ballot = classifier::vote(*chosen->trained.cores(), *features,
                                           {classifier::VoteKind::shortlist, 2, &*profile});
      REQUIRE(ballot.has_value());
      right += chosen->trained.labels()[ballot->winner] == matrix->labels[row] ? 1 : 0;
    }
  }
  CHECK(right_answers(named(tradeoff, "short-list of 2")) == Approx(right).epsilon(1e-12));
  REQUIRE(tradeoff.left_out.size() == 1);
  CHECK(tradeoff.left_out[0].second.find("choice") != std::string::npos);
}

TEST_CASE("fixed factors are reported, and a study without factors is refused") {
  Dataset set = campaign_set();
  const TradeoffSet tradeoff = measured(
      set, options_for({TradeoffFamily::speed, TradeoffFamily::exploration, TradeoffFamily::vote},
                       random_splits));
  REQUIRE(tradeoff.left_out.size() == 2);
  CHECK(tradeoff.left_out[0].first == "speed");
  CHECK(tradeoff.left_out[1].first == "exploration");
  const auto refused = measure_classifier_tradeoff(
      set, options_for({TradeoffFamily::speed, TradeoffFamily::exploration}, random_splits),
      ticking());
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().got.find("speed: ") != std::string::npos);
  CHECK(refused.error().got.find("exploration: ") != std::string::npos);
}

TEST_CASE("a default that is no cores has no feature count and no vote") {
  auto options = options_for(
      {TradeoffFamily::features, TradeoffFamily::vote, TradeoffFamily::learner}, random_splits);
  options.learner = classifier::Learner::lda;
  const TradeoffSet tradeoff = measured(campaign_set(), options);
  CHECK(tradeoff.left_out.size() == 2);
  CHECK(named(tradeoff, "p-value cores").family == "learner");
}

TEST_CASE("one fabric, too few timings, no clock and a label that never trained are refused") {
  const auto options = options_for({TradeoffFamily::slide}, random_splits);
  Dataset one = campaign_set();
  for (auto& trial : one.trials) trial.label = "wool";
  CHECK_FALSE(measure_classifier_tradeoff(one, options, ticking()).has_value());
  auto few = options;
  few.timings = 4;
  CHECK_FALSE(measure_classifier_tradeoff(campaign_set(), few, ticking()).has_value());
  CHECK_FALSE(measure_classifier_tradeoff(campaign_set(), options, {}).has_value());
  const auto unknown_label = options_for({TradeoffFamily::slide}, [](const auto& features) {
    SplitPlan plan{{{}}, "two fabrics train"};
    for (std::size_t r = 0; r < features.size(); ++r)
      (features.labels[r] == "pile" ? plan.splits[0].test : plan.splits[0].train).push_back(r);
    return Result<SplitPlan>(plan);
  });
  const auto refused = measure_classifier_tradeoff(campaign_set(), unknown_label, ticking());
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().got == "pile");
}

TEST_CASE("a family that does not exist is refused with the one that was meant") {
  for (const TradeoffFamily family : all_tradeoff_families())
    CHECK(*tradeoff_family_from(to_string(family)) == family);
  const auto wrong = tradeoff_family_from("learnr");
  REQUIRE_FALSE(wrong.has_value());
  CHECK(wrong.error().hint == "Did you mean learner?");
  CHECK(tradeoff_family_from("zebra").error().hint.empty());
}

}  // namespace trade_measure_test
