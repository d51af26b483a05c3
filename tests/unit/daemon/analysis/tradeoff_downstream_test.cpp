// `weft trade sim --downstream`: trials at several levels, comparison of their features, transfer
// of classifiers from one level to another.

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "daemon/analysis/tradeoff/sim/sim_page.hpp"
#include "tests/unit/plant/support.hpp"

namespace trade_downstream_test {

using namespace weft;
using namespace weft::daemon;

namespace {

/// Fabrics differ most under a rigid face.
const sim::FabricLibrary& library() {
  static const sim::FabricLibrary one = sim::test::library();
  return one;
}

/// One column; two rows of each label.
classifier::FeatureMatrix matrix(const std::vector<double>& a, const std::vector<double>& b) {
  classifier::FeatureMatrix out;
  out.names = {"only"};
  out.values = classifier::Matrix(a.size() + b.size(), 1);
  for (std::size_t i = 0; i < a.size() + b.size(); ++i) {
    out.values(i, 0) = i < a.size() ? a[i] : b[i - a.size()];
    out.labels.emplace_back(i < a.size() ? "a" : "b");
  }
  return out;
}

DownstreamCampaign small_campaign() {
  DownstreamCampaign out;
  out.fabrics = 3;
  out.trials = 4;
  out.slide_s = 1;
  return out;
}

}  // namespace

TEST_CASE("F is the variance between labels by that within, as computed by hand") {
  // means 2 and 6; within: (1 + 1 + 1 + 1)/2 = 2; between: 2 (2 - 4)^2 + 2 (6 - 4)^2 = 16
  CHECK(f_statistics(matrix({1, 3}, {5, 7})).front() == Approx(8));
  CHECK(f_statistics(matrix({1, 1}, {1, 1})).front() == 0);
  CHECK(std::isinf(f_statistics(matrix({1, 1}, {2, 2})).front()));
}

TEST_CASE("rank correlation knows order alone, and shares ranks among ties") {
  const std::vector<double> a{1, 2, 3, 4}, grown{10, 11, 12, 1e9}, turned{4, 3, 2, 1};
  CHECK(spearman(a, grown) == Approx(1));
  CHECK(spearman(a, turned) == Approx(-1));
  // ranks 1, 2, 3, 4 against 1.5, 1.5, 3, 4: 4.5/sqrt(5 * 4.5)
  CHECK(spearman(a, std::vector<double>{7, 7, 8, 9}) == Approx(4.5 / std::sqrt(22.5)));
  CHECK(spearman(a, std::vector<double>{5, 5, 5, 5}) == 0);
  const double infinite = std::numeric_limits<double>::infinity();
  CHECK(spearman(a, std::vector<double>{1, 2, infinite, infinite}) ==
        Approx(4.5 / std::sqrt(22.5)));
}

TEST_CASE("a feature's shift is counted in its deviations within a label") {
  // deviation within: sqrt(2); a moves by 2, b stays
  const auto yardstick = matrix({1, 3}, {5, 7}), moved = matrix({3, 5}, {5, 7});
  CHECK(feature_shifts(moved, yardstick).front() == Approx(1 / std::sqrt(2.0)));
  CHECK(feature_shifts(yardstick, yardstick).front() == 0);
}

TEST_CASE("the feature that moves most is that of the mean over seeds, not of the first one") {
  const std::vector<std::vector<double>> by_seed{{5, 1, 4}, {0, 1, 4}, {0, 9, 4}};
  CHECK(most_shifted(by_seed) == 2);
}

TEST_CASE("trials of one seed are the same trials at every level, seen with its mechanisms") {
  const DownstreamCampaign campaign = small_campaign();
  const auto levels = downstream_levels();
  const auto l0 = make_downstream_trials(library(), campaign, levels[0], 7);
  const auto l1 = make_downstream_trials(library(), campaign, levels[1], 7);
  const auto again = make_downstream_trials(library(), campaign, levels[1], 7);
  const auto other = make_downstream_trials(library(), campaign, levels[1], 8);
  REQUIRE(l0);
  REQUIRE(l1);
  REQUIRE(again);
  REQUIRE(other);
  REQUIRE(l1->pads.size() == 3 * 2 * 4);
  for (std::size_t i = 0; i < l1->pads.size(); ++i) {
    CHECK(l1->pads[i].counts == again->pads[i].counts);
    CHECK(l1->force[i].counts == again->force[i].counts);
    CHECK(l1->pads[i].counts != other->pads[i].counts);
    CHECK(l1->pads[i].phase == l0->pads[i].phase);
    CHECK(l1->pads[i].label == l0->pads[i].label);
    CHECK(l1->pads[i].samples() == l1->force[i].samples());
  }
  // Regulated to 5 N with 20 mN a count during the stroke: 250 counts, at L0 exactly except for the
  // noise.
  const classifier::Trial& trial = l0->force.front();
  for (std::size_t i = 0; i < trial.samples(); ++i)
    if (trial.phase[i] == Phase::motion) CHECK(trial.row(i)[2] == Approx(250).margin(3));
}

TEST_CASE("a classifier trained at L1 knows three very different cloths at L2") {
  DownstreamOptions options;
  options.campaign = small_campaign();
  options.seeds = 2;
  options.levels = {downstream_levels()[1], downstream_levels()[2]};
  options.learners = {classifier::Learner::lda};
  options.training.threads = 1;
  sim::FabricLibrary cloths = library();
  cloths.spread.touch = {.path_m = 0, .gain = 0.01, .pad_ratio = 0};  // a hundredth of the level
  const auto result = measure_downstream(cloths, options);
  if (!result) FAIL(to_string(result.error()));
  CHECK(result->fabrics == 3);
  // channels x same or other pieces x trained x tested
  REQUIRE(result->transfers.size() == 2 * 2 * 2 * 2);
  for (const Transfer& t : result->transfers) {
    CAPTURE(t.channels, t.trained, t.tested, t.across_swatches);
    CHECK(t.accuracy.values.size() == 2);
    CHECK(t.accuracy.ci95.low <= t.accuracy.mean);
    CHECK(t.accuracy.ci95.high >= t.accuracy.mean);
    CHECK(t.accuracy.ci95.high > t.accuracy.ci95.low);  // also if both seeds agree
    if (t.channels == "pads" && !t.across_swatches) CHECK(t.accuracy.mean > 0.9);
  }
  REQUIRE(result->shifts.size() == 2);
  CHECK(result->shifts.front().spearman.mean > 0.9);
  CHECK(result->shifts.front().max_shift.mean > 0);
  CHECK(result->shifts.front().max_shift.values.size() == 2);
  CHECK_FALSE(result->shifts.front().shifted.empty());
  const std::string html = render(downstream_section(*result));
  CHECK(html.find("SIMULATED") != std::string::npos);
  CHECK(html.find("nan") == std::string::npos);
  CHECK(downstream_json(*result)["bench"] == "simulated");
}

TEST_CASE("too few seeds or trials to compare levels are refused") {
  DownstreamOptions options;
  options.seeds = 1;
  CHECK_FALSE(measure_downstream(library(), options));
  options.seeds = 2;
  options.campaign.trials = 2;
  CHECK_FALSE(measure_downstream(library(), options));
}

}  // namespace trade_downstream_test
