// Campaign design against closed forms: power laws, resampling, the response of a known signal, the
// rule that takes a cell.

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "classifier/design/cells.hpp"
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

CellAnswers answers(std::size_t fabrics, std::size_t trials, std::size_t wrong) {
  CellAnswers out{std::vector<std::vector<bool>>(fabrics, std::vector<bool>(trials, true))};
  for (std::size_t i = 0; i < wrong; ++i) out.right[i % fabrics][i / fabrics] = false;
  return out;
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

/// Two labels apart by `gap` deviations in one of three features.
FeatureMatrix clouds(std::size_t labels, std::size_t groups, double gap, std::uint64_t seed) {
  FeatureMatrix m;
  m.names = {"a", "b", "c"};
  m.values = Matrix(labels * groups, 3, 0.0);
  RandomEngine engine(seed);
  for (std::size_t g = 0; g < groups; ++g)
    for (std::size_t l = 0; l < labels; ++l) {
      const std::size_t row = m.labels.size();
      for (std::size_t f = 0; f < 3; ++f)
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
  // 60 answers: 0.95 +- 0.03
  const std::vector<WeighedCell> cells{{answers(6, 10, 3), 40, 10},
                                       {answers(6, 10, 4), 10, 12},
                                       {answers(6, 10, 4), 10, 15},
                                       {answers(6, 10, 30), 5, 20}};
  const CellChoice choice = choose_cell(cells, 500, 1);
  CHECK(choice.most_separable == 0);
  CHECK(choice.chosen == 2);  // as quick as cell 1, with the larger signal
  CHECK(choice.cells[3].accuracy == 0.5);
  CHECK(choice.cells[3].chosen_share == 0);
  CHECK(choice.within == Approx(std::sqrt(57.5 / 61 * 3.5 / 61 / 60)));
  double sum = 0;
  for (const CellSummary& cell : choice.cells) sum += cell.chosen_share;
  CHECK(sum == Approx(1));
  CHECK(choice.overlapping == 2);
  CHECK(choice.quicker_overlapping == 0);  // cell 1 takes as long, cell 0 longer
}

TEST_CASE("A choice that chance made is not called supported") {
  std::vector<WeighedCell> alike, clear;
  for (std::size_t i = 0; i < 12; ++i) {
    const double seconds = 10 + static_cast<double>(i);
    alike.push_back({answers(6, 3, 6 + i % 2), seconds, 0});
    clear.push_back({answers(6, 30, i == 4 ? 0 : 90), seconds, 0});
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
  CHECK(apart->asked() == 15);
  CHECK(apart->accuracy() == 1);
  const auto same = separability(clouds(3, 20, 0, 2), Learner::lda, 1);
  REQUIRE(same);
  CHECK(same->accuracy() < 0.6);
  CHECK_FALSE(separability(clouds(3, 2, 8, 1), Learner::lda, 1));
  CHECK_FALSE(separability(clouds(1, 5, 8, 1), Learner::lda, 1));
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
  CHECK(curve->points.back().accuracy == Approx(separability(m, Learner::lda, 1)->accuracy()));
  options.threads = 1;
  const auto again = learning_curve(m, options);
  for (std::size_t i = 0; i < 6; ++i)
    CHECK(curve->points[i].error_by_tested == again->points[i].error_by_tested);
  CHECK_FALSE(learning_curve(clouds(3, 3, 2, 5), options));
  CHECK_FALSE(learning_curve(clouds(1, 8, 2, 5), options));
  options.most_points = 4;
  CHECK(learning_curve(clouds(2, 21, 3, 5), options)->points.size() == 4);
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
