// Campaign design against closed forms: power laws, resampling, the response of a known signal, the
// rule that takes a cell.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "classifier/design/cells.hpp"
#include "classifier/design/clustered.hpp"
#include "classifier/design/learning_curve.hpp"
#include "classifier/design/power_law.hpp"
#include "classifier/design/resample.hpp"
#include "classifier/design/response.hpp"

using namespace weft;
using namespace weft::classifier;
using namespace weft::classifier::design;

namespace {

std::vector<ErrorPoint> points_on(const PowerLaw& law) {
  std::vector<ErrorPoint> out;
  for (int m = 2; m <= 9; ++m) out.push_back({double(m), law.error_at(m), 1.0 + m});
  return out;
}

/// Trial k of each fabric is of replicate k; the first replicates have the wrong answers.
WeighedCell cell(std::size_t fabrics, std::size_t trials, std::size_t wrong, double seconds,
                 double snr_db) {
  WeighedCell out{std::vector<std::vector<CellTrial>>(fabrics)};
  for (std::size_t f = 0; f < fabrics; ++f)
    for (std::size_t k = 0; k < trials; ++k)
      out.fabrics[f].push_back({k, k * fabrics + f >= wrong, seconds, snr_db});
  return out;
}

double share_of(const std::vector<bool>& right) {
  return static_cast<double>(std::ranges::count(right, true)) / static_cast<double>(right.size());
}

/// Phase P of white noise of +-1 in turn, then M of a sinusoid of `amplitude` at `hz` on a ramp.
Trial sinusoid(double amplitude, double hz, double rate_hz, std::size_t motion) {
  Trial trial;
  trial.file = "t";
  trial.taxels = 1;
  for (std::size_t i = 0; i < 50; ++i) {
    trial.counts.push_back(1000 + (i % 2 == 0 ? 1 : -1));
    trial.phase.push_back(Phase::press);
  }
  for (std::size_t i = 0; i < motion; ++i) {
    const auto k = static_cast<double>(i);
    trial.counts.push_back(2000 + 0.5 * k +
                           amplitude * std::sin(2 * std::numbers::pi * hz * k / rate_hz));
    trial.phase.push_back(Phase::motion);
  }
  return trial;
}

/// Labels apart by `gap` deviations in one of the first three of so many features.
FeatureMatrix clouds(std::size_t labels, std::size_t groups, double gap, std::uint64_t seed,
                     std::size_t features = 3) {
  FeatureMatrix m;
  for (std::size_t f = 0; f < features; ++f) m.names.push_back("f" + std::to_string(f));
  m.values = Matrix(labels * groups, features, 0.0);
  RandomEngine engine(seed);
  for (std::size_t g = 0; g < groups; ++g)
    for (std::size_t l = 0; l < labels; ++l) {
      const std::size_t row = m.labels.size();
      for (std::size_t f = 0; f < features; ++f)
        m.values(row, f) = normal_draw(engine) + (f == l % 3 ? gap : 0);
      m.labels.push_back("l" + std::to_string(l));
      m.groups.push_back("r" + std::to_string(100 + g));
      m.files.push_back("f" + std::to_string(row));
    }
  return m;
}

}  // namespace

TEST_CASE("A power law is found again from points on it") {
  const PowerLaw truth{0.08, 0.6, 0.75};
  const PowerLaw found = fit_power_law(points_on(truth));
  CHECK(found.exponent == truth.exponent);
  CHECK(found.floor == Approx(truth.floor));
  CHECK(found.scale == Approx(truth.scale));
  CHECK(found.error_at(19) == Approx(0.08 + 0.6 * std::pow(19, -0.75)));
  CHECK(misfit(points_on(truth), found) == Approx(0).margin(1e-20));
}

TEST_CASE("A power law has no negative floor, and a curve that rises is taken for a flat one") {
  // through the origin: a floor under 0 would fit better
  const std::vector<ErrorPoint> steep{{1, 0.5, 1}, {2, 0.2, 1}, {4, 0.05, 1}};
  const PowerLaw law = fit_power_law(steep, 1.0);
  CHECK(law.floor == 0);
  CHECK(law.scale == Approx((0.5 + 0.1 + 0.0125) / (1 + 0.25 + 0.0625)));
  const std::vector<ErrorPoint> rising{{2, 0.1, 1}, {4, 0.2, 3}};
  const PowerLaw flat = fit_power_law(rising);
  CHECK(flat.scale == 0);
  CHECK(flat.error_at(100) == Approx(0.175));
}

TEST_CASE("Quantiles, means and normal draws are what they should be") {
  CHECK(quantile({4, 1, 3, 2, 5}, 0.5) == 3);
  CHECK(quantile({4, 1, 3, 2, 5}, 0.125) == 1.5);
  CHECK(quantile({7}, 0.9) == 7);
  std::vector<double> values;
  RandomEngine engine(3);
  for (int i = 0; i < 400; ++i) values.push_back(normal_draw(engine));
  CHECK(mean_of(values) == Approx(0).margin(0.15));
  CHECK(deviation_of(values) == Approx(1).margin(0.1));
  // of a mean: +- 1.96 sd / sqrt(n)
  const Interval interval = mean_interval(values, 2000, 1);
  CHECK(interval.high - interval.low == Approx(2 * 1.96 * deviation_of(values) / 20).epsilon(0.1));
  CHECK(interval.low < mean_of(values));
  CHECK(interval.high > mean_of(values));
}

TEST_CASE("The response of a sinusoid is its power over that of the noise in the band") {
  constexpr double rate = 40, hz = 2;  // 2 mm/s over a period of 1 mm
  const auto found = response_of(sinusoid(10, hz, rate, 400), rate, 2e-3, 0, 65535);
  REQUIRE(found);
  CHECK(found->low_hz == Approx(0.4));
  CHECK(found->high_hz == Approx(10));
  CHECK(found->signal_counts2 == Approx(50).epsilon(0.01));
  // successive differences of 2: variance 2; bins 4 to 100 of 200
  CHECK(found->noise_counts2 == Approx(2.0 * 97 / 200));
  CHECK(found->snr_db == Approx(10 * std::log10(50 / 0.97)).margin(0.05));
  CHECK(found->saturated_share == 0);
  // out of the band: 12 Hz is a period of 0.17 mm
  const auto out = response_of(sinusoid(10, 12, rate, 400), rate, 2e-3, 0, 65535);
  REQUIRE(out);
  CHECK(out->signal_counts2 < 0.01 * found->signal_counts2);
  // the ramp alone passes 2100 after 200 of 400 samples
  CHECK(response_of(sinusoid(0, hz, rate, 400), rate, 2e-3, 0, 2100)->saturated_share == 0.5);
  CHECK_FALSE(response_of(sinusoid(1, hz, rate, 4), rate, 2e-3, 0, 65535));
  CHECK_FALSE(response_of(sinusoid(1, hz, rate, 400), 0, 2e-3, 0, 65535));
}

TEST_CASE("Of cells within a standard error of the best the quickest is taken") {
  // wrong answers one in each replicate: they do not hang together. 60 answers: 0.95 +- 0.03
  const auto spread = [](std::size_t wrong, double seconds, double snr_db) {
    WeighedCell out = cell(6, 10, 0, seconds, snr_db);
    for (std::size_t i = 0; i < wrong; ++i) out.fabrics[i % 6][i % 10].right = false;
    return out;
  };
  WeighedCell half = cell(6, 10, 0, 5, 20);
  for (auto& fabric : half.fabrics)
    for (CellTrial& trial : fabric) trial.right = trial.replicate % 2 == 0;
  for (std::size_t f = 0; f < 3; ++f)
    for (CellTrial& trial : half.fabrics[f]) trial.right = !trial.right;
  const std::vector<WeighedCell> cells{spread(3, 40, 10), spread(4, 10, 12), spread(4, 10, 15),
                                       half};
  const CellChoice choice = choose_cell(cells, 500, 1);
  CHECK(choice.design_effect == 1);
  CHECK(choice.most_separable == 0);
  CHECK(choice.chosen == 2);  // as quick as cell 1, with the larger signal
  CHECK(choice.quickest == 1);
  CHECK(choice.equal_time == 2);
  CHECK(choice.cells[3].figures.accuracy == 0.5);
  CHECK(choice.cells[3].chosen_share == 0);
  CHECK(choice.within == Approx(std::sqrt(57.5 / 61 * 3.5 / 61 / 60)));
  double sum = 0;
  for (const CellSummary& one : choice.cells) sum += one.chosen_share;
  CHECK(sum == Approx(1));
  CHECK(choice.overlapping == 2);
  CHECK(choice.quicker_overlapping == 0);  // cell 1 takes as long, cell 0 longer
}

TEST_CASE("Seconds that hardly differ are equal, and the signal over noise decides") {
  const std::vector<CellFigures> near{{0.9, 10.00, 0, 1}, {0.9, 10.49, 0, 12}, {0.9, 10.51, 0, 30}};
  CHECK(take(near, 60) == 1);  // 5 % of 10 s
  CHECK_FALSE(takes_less(near[0], near[1]));
  CHECK(takes_less(near[0], near[2]));
  // medians that are as uncertain as that are equal too
  std::vector<CellFigures> loose = near;
  for (CellFigures& one : loose) one.seconds_error = 0.2;  // of a difference: 1.96 x 0.28
  CHECK(take(loose, 60) == 2);
  // separability comes first: 0.9 against 0.5 of 60 answers is no draw
  const std::vector<CellFigures> worse{{0.9, 10, 0, 1}, {0.5, 10, 0, 30}};
  CHECK(take(worse, 60) == 0);
  // many milliseconds in a chain are no reason to take a slow cell
  std::vector<CellFigures> chain;
  for (int i = 0; i < 10; ++i) chain.push_back({0.9, 10 + 0.3 * i, 0, double(i)});
  CHECK(take(chain, 60) == 1);
}

TEST_CASE("Of equal times a pilot done again takes the cell with the larger signal as well") {
  const std::vector<WeighedCell> cells{cell(6, 10, 0, 10.0, 1), cell(6, 10, 0, 10.2, 12)};
  const CellChoice choice = choose_cell(cells, 300, 1);
  CHECK(choice.chosen == 1);
  CHECK(choice.share == Approx(1));
  CHECK(choice.quicker_overlapping == 0);
  CHECK(choice.supported);
}

TEST_CASE("The front has what no cell beats in accuracy and time") {
  const std::vector<CellFigures> cells{
      {0.9, 20, 0, 0}, {0.8, 10, 0, 0}, {0.9, 20.5, 0, 0}, {0.8, 12, 0, 0}, {0.85, 19.5, 0, 0}};
  CHECK(front_of(cells) == std::vector<std::size_t>{1, 0, 2});  // 3 is slow, 4 no quicker than 0
  const std::vector<CellFigures> plain{{0.5, 1, 0, 0}, {0.7, 2, 0, 0}, {0.6, 3, 0, 0}};
  CHECK(front_of(plain) == std::vector<std::size_t>{0, 1});
}

TEST_CASE("Answers that hang together in a replicate count for fewer") {
  const ClusteredShare together{{1, 1, 0}, 6}, apart{{4.0 / 6, 4.0 / 6, 4.0 / 6}, 6};
  const std::vector<ClusteredShare> all{together}, none{apart}, both{together, apart};
  CHECK(design_effect(all) == 6);   // all or nothing: 3 answers, not 18
  CHECK(design_effect(none) == 1);  // less than by chance
  // between: 6 x 1/3 + 0; if independent: 2/9 x 18/17 of each
  CHECK(design_effect(both) == Approx(2 / (2 * 2.0 / 9 * 18 / 17)));
  const Interval wide = clustered_interval(together, 6), plain = wilson_interval(12, 18);
  CHECK(wide.low == Approx(wilson_interval(2, 3).low));
  CHECK(wide.high == Approx(wilson_interval(2, 3).high));
  CHECK(clustered_interval(apart, 1).low == Approx(plain.low));
  const std::vector<ClusteredShare> sure{{{1, 1, 1}, 6}};
  CHECK(design_effect(sure) == 1);
  CHECK(clustered_interval(sure[0], 1).low == Approx(wilson_interval(18, 18).low));
  CHECK(clustered_interval(sure[0], 1).high == 1);
}

TEST_CASE("A choice knows of replicates that are right or wrong as a whole") {
  // the same accuracies, once spread over the replicates, once a replicate at a time
  const auto cells = [](bool together) {
    std::vector<WeighedCell> out;
    for (std::size_t i = 0; i < 4; ++i) {
      WeighedCell& one = out.emplace_back(cell(6, 6, together ? 6 : 0, 10 + double(i), 0));
      for (std::size_t f = 0; f < 6 && !together; ++f) one.fabrics[f][f].right = false;
    }
    return out;
  };
  const CellChoice apart = choose_cell(cells(false), 200, 1);
  const CellChoice together = choose_cell(cells(true), 200, 1);
  CHECK(apart.cells[0].figures.accuracy == together.cells[0].figures.accuracy);
  CHECK(apart.design_effect == 1);
  CHECK(together.design_effect == Approx(6).epsilon(0.01));
  const auto width = [](const CellChoice& c) { return c.cells[0].ci95.high - c.cells[0].ci95.low; };
  CHECK(width(together) > 1.8 * width(apart));
  CHECK(together.within > 1.8 * apart.within);
  CHECK(together.cells[0].ci95.low == Approx(wilson_interval(5, 6).low).margin(0.01));
}

TEST_CASE("A choice that chance made is not called supported") {
  std::vector<WeighedCell> alike, clear;
  for (std::size_t i = 0; i < 12; ++i) {
    const double seconds = 10 + static_cast<double>(i);
    alike.push_back(cell(6, 3, 6 + i % 2, seconds, 0));
    clear.push_back(cell(6, 30, i == 4 ? 0 : 90, seconds, 0));
  }
  const CellChoice chance = choose_cell(alike, 500, 1);
  CHECK_FALSE(chance.supported);
  CHECK(chance.overlapping == 11);
  const CellChoice sure = choose_cell(clear, 500, 1);
  CHECK(sure.chosen == 4);
  CHECK(sure.share == Approx(1));
  CHECK(sure.supported);
  CHECK(sure.overlapping == 0);
}

TEST_CASE("Separability leaves each replicate out: what only a replicate shares is no help") {
  const auto apart = separability(clouds(3, 5, 8, 1), Learner::lda, 1);
  REQUIRE(apart);
  CHECK(apart->size() == 15);
  CHECK(share_of(*apart) == 1);
  CHECK_FALSE(separability(clouds(3, 2, 8, 1), Learner::lda, 1));
  CHECK_FALSE(separability(clouds(1, 5, 8, 1), Learner::lda, 1));
  // every replicate has five copies of each trial, and nothing but the copies tells a label
  const FeatureMatrix once = clouds(3, 6, 0, 2, 60);
  FeatureMatrix copies = once;
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < once.size(); ++i) rows.insert(rows.end(), 5, i);
  copies = take_rows(once, rows);
  const auto blind = separability(copies, Learner::lda, 1);
  REQUIRE(blind);
  CHECK(share_of(*blind) < 0.6);
  // the test sees the leak: left out one by one, the copies give the answer away
  FeatureMatrix leaking = copies;
  for (std::size_t i = 0; i < leaking.size(); ++i) leaking.groups[i] = "r" + std::to_string(i % 5);
  const auto seen = separability(leaking, Learner::lda, 1);
  REQUIRE(seen);
  CHECK(share_of(*seen) > 0.95);
}

TEST_CASE("A fabric that is in one replicate alone cannot be asked about") {
  FeatureMatrix lacking = clouds(3, 4, 8, 1);
  std::vector<std::size_t> rows;
  for (std::size_t i = 0; i < lacking.size(); ++i)
    if (lacking.labels[i] != "l2" || lacking.groups[i] == "r100") rows.push_back(i);
  rows.push_back(2);  // twice, so that a learner takes it
  const auto refused = separability(take_rows(lacking, rows), Learner::lda, 1);
  REQUIRE_FALSE(refused);
  CHECK_THAT(to_string(refused.error()), Catch::Contains("one replicate alone"));
}

TEST_CASE("A learning curve rises, its last point is plain leave-one-repetition-out") {
  const FeatureMatrix m = clouds(3, 8, 2, 5);
  CurveOptions options;
  options.learner = Learner::lda;
  options.threads = 2;
  const auto curve = learning_curve(m, options);
  REQUIRE(curve);
  REQUIRE(curve->points.size() == 6);
  CHECK(curve->points.front().repetitions == 3);
  CHECK(curve->points.back().repetitions == 8);
  CHECK(curve->repetitions == 8);
  CHECK(curve->fabrics == 3);
  CHECK(curve->points.back().accuracy == Approx(share_of(*separability(m, Learner::lda, 1))));
  options.threads = 1;
  const auto again = learning_curve(m, options);
  for (std::size_t i = 0; i < 6; ++i)
    CHECK(curve->points[i].error_by_tested == again->points[i].error_by_tested);
  CHECK_FALSE(learning_curve(clouds(3, 3, 2, 5), options));
  CHECK_FALSE(learning_curve(clouds(1, 8, 2, 5), options));
  options.most_points = 4;
  CHECK(learning_curve(clouds(2, 21, 3, 5), options)->points.size() == 4);
}

TEST_CASE("A point of a learning curve without an error has an interval all the same") {
  CurveOptions options;
  options.learner = Learner::lda;
  const auto sure = learning_curve(clouds(3, 8, 12, 5), options);
  REQUIRE(sure);
  const CurvePoint& last = sure->points.back();
  REQUIRE(last.accuracy == 1);
  CHECK(last.ci95.low == Approx(wilson_interval(24, 24).low));  // 0.862
  CHECK(last.ci95.high == 1);
  // repetitions that fail as a whole: wider by up to sqrt(3), for the other points have a say
  FeatureMatrix moved = clouds(3, 8, 12, 5);
  for (std::size_t r = 0; r < 6; ++r) moved.labels[r] = "l" + std::to_string((r + 1) % 3);
  const auto partly = learning_curve(moved, options);
  REQUIRE(partly);
  const CurvePoint& end = partly->points.back();
  REQUIRE(end.accuracy == Approx(0.75));
  CHECK(end.ci95.high - end.ci95.low >
        1.3 * (wilson_interval(18, 24).high - wilson_interval(18, 24).low));
}

TEST_CASE("A forecast of a noiseless curve lies on its law, and says how many are enough") {
  LearningCurve curve;
  curve.repetitions = 10;
  curve.fabrics = 100;
  curve.trials = 100'000'000;  // so many that only the law is left
  const PowerLaw truth{0.05, 0.4, 1};
  for (std::size_t n = 3; n <= 10; ++n)
    curve.points.push_back({n,
                            1 - truth.error_at(double(n) - 1),
                            {},
                            std::vector<double>(10, truth.error_at(double(n) - 1))});
  ForecastOptions options;
  options.accuracy = 0.8999;  // 0.05 + 0.4 / m <= 0.1 from m = 8 on
  const auto found = forecast_repetitions(curve, options);
  REQUIRE(found);
  CHECK(found->accuracy == Approx(1 - truth.error_at(19)).epsilon(1e-4));
  CHECK(found->enough == 9);
  CHECK(found->reached_share == 1);
  options.accuracy = 0.96;  // over 1 - floor
  const auto never = forecast_repetitions(curve, options);
  CHECK_FALSE(never->enough);
  CHECK(never->reached_share == 0);
  options.accuracy = 1.5;
  CHECK_FALSE(forecast_repetitions(curve, options));
}
