// Campaign design against closed forms: power laws, resampling, the response of a known signal,
// learning curves.

#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "classifier/design/cells.hpp"
#include "classifier/design/learning_curve.hpp"
#include "classifier/design/resample.hpp"
#include "classifier/design/response.hpp"
#include "tests/unit/classifier/design_data.hpp"

namespace design_test {

using namespace weft;
using namespace weft::classifier;
using namespace weft::classifier::design;
using test::clouds;
using test::share_of;

namespace {

std::vector<ErrorPoint> points_on(const PowerLaw& law) {
  std::vector<ErrorPoint> out;
  for (int m = 2; m <= 9; ++m) out.push_back({double(m), law.error_at(m), 1.0 + m});
  return out;
}

/// Phase P of alternating noise of +-1, then M of a sinusoid of `amplitude` at `hz` on a ramp.
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

TEST_CASE("A power law has no negative floor, and a rising curve is fitted as a flat one") {
  // through the origin: a negative floor would fit better
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
  CHECK(compute_mean(values) == Approx(0).margin(0.15));
  CHECK(compute_deviation(values) == Approx(1).margin(0.1));
  // of a mean: +- 1.96 sd / sqrt(n)
  const Interval interval = mean_interval(values, 2000, 1);
  CHECK(interval.high - interval.low ==
        Approx(2 * 1.96 * compute_deviation(values) / 20).epsilon(0.1));
  CHECK(interval.low < compute_mean(values));
  CHECK(interval.high > compute_mean(values));
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
  // repetitions that fail as a whole: wider by up to sqrt(3), because the other points count too
  FeatureMatrix moved = clouds(3, 8, 12, 5);
  for (std::size_t r = 0; r < 6; ++r) moved.labels[r] = "l" + std::to_string((r + 1) % 3);
  const auto partly = learning_curve(moved, options);
  REQUIRE(partly);
  const CurvePoint& end = partly->points.back();
  REQUIRE(end.accuracy == Approx(0.75));
  CHECK(end.ci95.high - end.ci95.low >
        1.3 * (wilson_interval(18, 24).high - wilson_interval(18, 24).low));
}

TEST_CASE("A forecast of a noiseless curve lies on its law, and states how many are enough") {
  LearningCurve curve;
  curve.repetitions = 10;
  curve.fabrics = 100;
  curve.trials = 100'000'000;  // large enough that only the law remains
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
  ForecastOptions impossible = options;
  impossible.accuracy = 1.5;
  CHECK(forecast_repetitions(curve, impossible).error().expected == "above 0 and below 1");
  impossible = options;
  impossible.predict = 2;
  CHECK(forecast_repetitions(curve, impossible).error().expected == "at least 3");
  impossible = options;
  impossible.resamples = 0;
  CHECK(forecast_repetitions(curve, impossible).error().got == "0");
}

}  // namespace design_test
