// Estimators on signals with a known answer.

#include <catch2/catch.hpp>

#include "daemon/analysis/calibration/signal.hpp"
#include "tests/unit/daemon/analysis/calibration/strokes.hpp"

namespace weft::daemon::calibration::signal_test {
namespace {

std::vector<double> made(std::size_t samples, const std::function<double(std::size_t)>& value) {
  std::vector<double> out;
  for (std::size_t i = 0; i < samples; ++i) out.push_back(value(i));
  return out;
}

double noise(std::size_t i) {
  return test::draw(1, 0, i);
}

}  // namespace

TEST_CASE("Order statistics lie between neighbours, and are absent of nothing") {
  CHECK(median({3, 1, 2}) == 2.0);
  CHECK(median({4, 1, 2, 3}) == 2.5);
  CHECK(quantile({0, 10}, 0.25) == 2.5);
  CHECK_FALSE(median({}));
  CHECK_FALSE(sample_sd(std::vector{1.0}));
  CHECK(*sample_sd(std::vector{1.0, 3.0}) == Approx(std::sqrt(2.0)));
}

TEST_CASE("A variance far from 0 keeps its digits") {
  CHECK(variance(made(1000, [](std::size_t i) { return 1e9 + static_cast<double>(i % 2); })) ==
        0.25);
}

TEST_CASE("A line is taken away whole, and its slope is found") {
  const auto line = made(101, [](std::size_t i) { return 7 + 0.5 * static_cast<double>(i); });
  CHECK(slope(line) == Approx(0.5));
  for (const double v : without_line(line)) CHECK(std::abs(v) < 1e-12);
  CHECK(slope(std::vector{5.0}) == 0);
}

TEST_CASE("Correlation knows equal, opposite and constant signals") {
  const auto a = made(50, noise);
  const auto opposite = made(50, [](std::size_t i) { return 3 - 2 * noise(i); });
  CHECK(correlation(a, a) == Approx(1));
  CHECK(correlation(a, opposite) == Approx(-1));
  CHECK(correlation(a, std::vector(50, 4.0)) == 0);
}

TEST_CASE("Noise is found below a texture that is thirty times as large") {
  const auto signal =
      made(4000, [](std::size_t i) { return 60 * test::wave(i, 20) + 2 * noise(i); });
  CHECK(noise_sd(signal) == Approx(2).epsilon(0.05));
  CHECK(noise_sd(std::vector(10, 4.0)) == 0);
  CHECK(noise_sd(std::vector{1.0, 2.0}) == 0);
}

TEST_CASE("Jumps are counted, noise is not") {
  const auto noise_only = made(2000, noise);
  CHECK(jump_share(noise_only) < 1e-3);
  const auto stepped =
      made(2001, [](std::size_t i) { return 0.1 * noise(i) + static_cast<double>(i / 200); });
  // a step of ten sd each 200 samples
  CHECK(jump_share(stepped) == Approx(10 / 2000.0).epsilon(0.11));
  CHECK(jump_share(std::vector(10, 1.0)) == 0);
}

TEST_CASE("A wave is in its band with its rms, and nowhere else") {
  const auto signal = made(2100, [](std::size_t i) { return 3 * test::wave(i, 5); });
  const auto rms = band_rms({signal}, test::pitch_mm).at(0);  // 0.2 /mm
  CHECK(*rms[2] == Approx(3 / std::sqrt(2.0)).epsilon(0.01));
  for (const std::size_t other : {0U, 1U, 3U, 4U}) CHECK(*rms[other] < 0.01);
}

TEST_CASE("White noise fills bands by their width") {
  const auto rms = band_rms({made(2100, noise)}, test::pitch_mm).at(0);
  CHECK(*rms[3] == Approx(std::sqrt(0.7 / 2)).epsilon(0.1));  // Nyquist: 2 /mm
}

TEST_CASE("A ninth channel has a spectrum of its own") {
  std::vector channels(9, std::vector<double>(500, 0.0));
  for (std::size_t i = 0; i < 500; ++i) channels[8][i] = test::wave(i, 5);
  const auto rms = band_rms(channels, test::pitch_mm);
  CHECK(*rms[8][2] == Approx(1 / std::sqrt(2.0)).epsilon(0.02));
  CHECK(*rms[7][2] == 0);
}

TEST_CASE("Bands that a stroke cannot hold are absent") {
  const auto signal = made(200, noise);
  const auto brief = band_rms({signal}, test::pitch_mm).at(0);  // 50 mm: no wave of 100 mm
  CHECK_FALSE(brief[0]);
  CHECK(brief[1]);
  CHECK(brief[4]);
  const auto coarse = band_rms({signal}, 4.2).at(0);  // Nyquist 0.119 /mm
  CHECK(coarse[1]);
  CHECK_FALSE(coarse[2]);
  CHECK(band_rms({}, 1).empty());
}

TEST_CASE("The noise law gives its parameters back, and none is negative") {
  std::vector<double> level, exact, falling;
  for (const double l : {20.0, 50.0, 90.0, 160.0, 300.0}) {
    level.push_back(l);
    exact.push_back(std::sqrt(1.44 + 0.01 * l + 2e-5 * l * l));
    falling.push_back(std::sqrt(4 - 0.01 * l));
  }
  const auto law = fit_noise_law(level, exact);
  REQUIRE(law);
  CHECK(law->s0 == Approx(1.2));
  CHECK(law->k1 == Approx(0.01));
  CHECK(law->k2 == Approx(2e-5));
  const auto bounded = fit_noise_law(level, falling);
  REQUIRE(bounded);
  CHECK(bounded->k1 == 0);
  CHECK(bounded->k2 == 0);
  CHECK(bounded->s0 * bounded->s0 == Approx(4 - 0.01 * 160).epsilon(0.02));  // the second lowest
  CHECK_FALSE(fit_noise_law(std::vector(5, 7.0), exact));
  CHECK_FALSE(fit_noise_law({}, {}));
}

TEST_CASE("The exponent is that of a power, whatever points have no logarithm") {
  std::vector<double> level{0}, sd{1};
  for (const double l : {20.0, 50.0, 90.0}) {
    level.push_back(l);
    sd.push_back(0.2 * std::pow(l, 0.54));
  }
  CHECK(*fit_exponent(level, sd) == Approx(0.54));
  CHECK_FALSE(fit_exponent(std::vector(3, 2.0), std::vector(3, 1.0)));
}

}  // namespace weft::daemon::calibration::signal_test
