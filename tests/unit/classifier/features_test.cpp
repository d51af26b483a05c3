#include <catch2/catch.hpp>
#include <limits>
#include <numbers>

#include "classifier/features/extract.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/features/signal.hpp"
#include "classifier/features/spectrum.hpp"
#include "classifier/features/windows.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier {
namespace {

using testing::motion_trial;
using testing::relative_difference;

// The feature called `name` of a trial.
double feature(const Trial& trial, const std::string& name, const FeatureOptions& options = {}) {
  const auto values = extract(trial, options);
  REQUIRE(values);
  const auto names = FeatureLayout(trial.taxels, phases_of(trial)).names();
  const auto at = std::find(names.begin(), names.end(), name);
  REQUIRE(at != names.end());
  return (*values)[static_cast<std::size_t>(at - names.begin())];
}

// Magnitudes straight from the definition of the transform, in long double.
std::vector<double> slow_magnitudes(const std::vector<double>& signal) {
  const std::size_t n = signal.size();
  std::vector<double> out;
  for (std::size_t k = 0; k <= n / 2; ++k) {
    long double re = 0, im = 0;
    for (std::size_t j = 0; j < n; ++j) {
      const long double angle = 2.0L * std::numbers::pi_v<long double> *
                                static_cast<long double>(j * k % n) / static_cast<long double>(n);
      re += signal[j] * std::cos(angle);
      im -= signal[j] * std::sin(angle);
    }
    out.push_back(static_cast<double>(std::sqrt(re * re + im * im)));
  }
  return out;
}

std::vector<double> noise(std::size_t n, std::uint64_t seed) {
  RandomEngine engine(seed);
  std::vector<double> out;
  for (std::size_t i = 0; i < n; ++i) out.push_back(testing::normal(engine));
  return out;
}

TEST_CASE("Sixteen taxels and all phases give the 195 features of Table I, in its order") {
  const FeatureLayout layout(16, {true, true, true});
  REQUIRE(layout.size() == 195);
  const auto& c = layout.columns();
  CHECK(c[0].name == "mean.P");
  CHECK(c[1].name == "diff.SP");
  CHECK(c[2].name == "diff.PE");
  CHECK(c[3].name == "max.M.1");
  CHECK(c[115].symbol == "F_range^M.1");  // number 116 of the table
  CHECK(c[118].name == "range.M.4");
  CHECK(c[118].taxel == 4);
  CHECK(c[147].name == "m5.M.1");
  CHECK(c[147].unit == "count^5");
  CHECK(c[194].name == "Sh.M.16");
}

TEST_CASE("A feature whose phase was not recorded is absent, not zero") {
  CHECK(FeatureLayout(16, {}).size() == 192);
  CHECK(FeatureLayout(16, {true, false, true}).size() == 192);
  CHECK(FeatureLayout(2, {false, true, true}).names()[1] == "diff.PE");
}

TEST_CASE("Means of the phases are over all taxels and samples; differences are S-P and P-E") {
  Trial trial;
  trial.taxels = 2;
  trial.phase = {Phase::rest, Phase::press, Phase::press, Phase::motion, Phase::end, Phase::none};
  trial.counts = {1, 3, 10, 20, 30, 40, 7, 7, 5, 6, 1000, 1000};
  CHECK(feature(trial, "mean.P") == 25.0);
  CHECK(feature(trial, "diff.SP") == 2.0 - 25.0);
  CHECK(feature(trial, "diff.PE") == 25.0 - 5.5);
}

TEST_CASE("Moments of 1..5 have their closed forms") {
  const Trial trial = motion_trial(std::vector<double>{1, 2, 3, 4, 5});
  CHECK(feature(trial, "max.M.1") == 5.0);
  CHECK(feature(trial, "min.M.1") == 1.0);
  CHECK(feature(trial, "mean.M.1") == 3.0);
  CHECK(feature(trial, "var.M.1") == 2.5);
  CHECK(feature(trial, "norm.M.1") == std::sqrt(55.0));
  CHECK(feature(trial, "norm.M.1", {.norm = Norm::rms}) == std::sqrt(11.0));
  CHECK(feature(trial, "kurt.M.1") == Approx(6.8 / 4.0).epsilon(1e-15));
  CHECK(feature(trial, "range.M.1") == 4.0);
  CHECK(feature(trial, "m5.M.1") == 0.0);
}

TEST_CASE("Third and fifth moment of 0 0 0 0 1 have the Bernoulli values") {
  const double p = 0.2, q = 0.8;
  const Moments m = moments_of(std::vector<double>{0, 0, 0, 0, 1});
  CHECK(m.m3 == Approx(p * q * (q - p)).epsilon(1e-14));
  CHECK(m.m5 == Approx(p * std::pow(q, 5) - q * std::pow(p, 5)).epsilon(1e-14));
  CHECK(skewness_of(std::vector<double>{0, 0, 0, 0, 1}) == Approx((q - p) / std::sqrt(p * q)));
}

TEST_CASE("A large offset does not change the moments about the mean") {
  const std::vector<double> small = {0, 1, 0, 2, 1, 5, 0, 1};
  std::vector<double> high = small;
  for (double& v : high) v += 1e9;
  CHECK(moments_of(high).m2 == moments_of(small).m2);
  CHECK(moments_of(high).m5 == Approx(moments_of(small).m5).epsilon(1e-6));
}

TEST_CASE("A flat top is one peak, end points are none") {
  std::vector<double> peaks;
  local_maxima(std::vector<double>{9, 1, 3, 3, 3, 1, 2, 2, 4, 4, 0, 8}, peaks);
  CHECK(peaks == std::vector<double>{3, 4});
  local_maxima(std::vector<double>{5, 5, 5}, peaks);
  CHECK(peaks.empty());
  local_maxima(std::vector<double>{}, peaks);
  CHECK(peaks.empty());
}

TEST_CASE("Skewness of the peaks is of the peaks, with the option of the signal's") {
  const Trial trial = motion_trial(std::vector<double>{0, 1, 0, 1, 0, 4, 0});  // peaks 1, 1, 4
  CHECK(feature(trial, "skew.M.1") == Approx(std::sqrt(0.5)).epsilon(1e-14));
  const double of_signal = feature(trial, "skew.M.1", {.skew = SkewOf::signal});
  CHECK(of_signal == Approx(skewness_of(std::vector<double>{0, 1, 0, 1, 0, 4, 0})));
}

TEST_CASE("The mode is the smallest of the most frequent values, on the grid of its bin") {
  CHECK(mode_of(std::vector<double>{5, 3, 3, 5, 9}, 1.0) == 3.0);
  CHECK(mode_of(std::vector<double>{0.9, 1.1, 7.0, 1.2}, 1.0) == 1.0);
  CHECK(mode_of(std::vector<double>{11, 12, 28}, 10.0) == 10.0);
  CHECK(mode_of(std::vector<double>{65535, 0, 65535}, 1.0) == 65535.0);
  CHECK(mode_of(std::vector<double>{-4, -4, 1e9, 1e9, 2}, 1.0) == -4.0);
}

TEST_CASE("A constant signal has skewness 0, kurtosis 3 and no spectrum, whatever its rounding") {
  const Trial trial = motion_trial(std::vector<double>(37, 0.1));
  for (const char* name : {"var.M.1", "skew.M.1", "range.M.1", "m5.M.1", "Hfrq.M.1", "Sh.M.1"}) {
    INFO(name);
    CHECK(feature(trial, name) == 0.0);
  }
  CHECK(feature(trial, "kurt.M.1") == 3.0);
}

TEST_CASE("A one-count glitch in a constant signal stays finite") {
  std::vector<double> signal(925, 1000.0);
  signal[400] = 1001.0;
  const double n = 925.0;
  const Trial trial = motion_trial(signal);
  // kurtosis of a Bernoulli variable of p = 1/n: 1/(p q) - 3 excess
  const double p = 1.0 / n;
  CHECK(feature(trial, "kurt.M.1") == Approx(1.0 / (p * (1.0 - p)) - 3.0).epsilon(1e-12));
}

TEST_CASE("Motions of one, two and three samples have their documented values") {
  const Trial one = motion_trial(std::vector<double>{7});
  CHECK(feature(one, "var.M.1") == 0.0);
  CHECK(feature(one, "kurt.M.1") == 3.0);
  CHECK(feature(one, "Hfrq.M.1") == 0.0);
  CHECK(feature(one, "Sh.M.1") == 0.0);
  const Trial two = motion_trial(std::vector<double>{4, 10});
  CHECK(feature(two, "var.M.1") == 18.0);
  CHECK(feature(two, "kurt.M.1") == 3.0);
  CHECK(feature(two, "Hfrq.M.1") == Approx(6.0));  // 2/T |4 - 10|
  CHECK(feature(motion_trial(std::vector<double>{1, 5, 1}), "kurt.M.1") == 3.0);
}

TEST_CASE("Saturated and silent taxels next to live ones do not disturb them") {
  std::vector<std::vector<double>> rows;
  const auto live = noise(101, 4);
  for (const double v : live) rows.push_back({65535, v, 0});
  const Trial three = motion_trial(rows);
  const Trial alone = motion_trial(live);
  for (const char* block : {"var.M.", "Hfrq.M.", "Sh.M.", "m5.M."}) {
    CHECK(relative_difference(feature(three, std::string(block) + "2"),
                              feature(alone, std::string(block) + "1")) < 1e-12);
    CHECK(feature(three, std::string(block) + "1") == 0.0);
  }
  CHECK(feature(three, "mode.M.1") == 65535.0);
}

TEST_CASE("NaN and infinity are refused with the place of the sample") {
  for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
    Trial trial = motion_trial({{1, 2}, {3, 4}, {5, 6}});
    trial.counts[3] = bad;
    const auto result = extract(trial);
    REQUIRE_FALSE(result);
    CHECK(result.error().where == "trial.csv: sample 1, taxel 2");
  }
}

TEST_CASE("Empty motion, no taxels, sizes that disagree and overflow are refused") {
  Trial still = motion_trial(std::vector<double>{1, 2});
  still.phase = {Phase::press, Phase::end};
  CHECK_FALSE(extract(still));
  CHECK_FALSE(extract(Trial{}));
  Trial short_one = motion_trial({{1, 2}, {3, 4}, {5, 6}});
  short_one.counts.pop_back();
  CHECK_FALSE(extract(short_one));
  CHECK_FALSE(extract(motion_trial(std::vector<double>{1e300, -1e300, 1e300, 2})));
  CHECK_FALSE(extract(motion_trial(std::vector<double>{1, 2}), {.mode_bin_counts = 0.0}));
}

TEST_CASE("The spectrum equals the definition at every length up to 40 and at primes") {
  std::vector<std::size_t> lengths = {97, 101, 128, 251};
  for (std::size_t n = 1; n <= 40; ++n) lengths.push_back(n);
  for (const std::size_t n : lengths) {
    INFO("length " << n);
    const auto a = noise(n, n), b = noise(n, n + 1000);
    Spectrum spectrum(n);
    std::vector<double> got_a(n / 2 + 1), got_b(n / 2 + 1);
    spectrum.magnitudes(a, b, got_a, got_b);
    const auto want_a = slow_magnitudes(a), want_b = slow_magnitudes(b);
    for (std::size_t k = 0; k <= n / 2; ++k) {
      CHECK(std::abs(got_a[k] - want_a[k]) < 1e-13 * static_cast<double>(n));
      CHECK(std::abs(got_b[k] - want_b[k]) < 1e-13 * static_cast<double>(n));
    }
  }
}

TEST_CASE("Parseval: the spectrum of a prime length keeps the signal's energy") {
  const std::size_t n = 911;
  const auto a = noise(n, 1);
  Spectrum spectrum(n);
  std::vector<double> bins(n / 2 + 1), other(n / 2 + 1);
  spectrum.magnitudes(a, a, bins, other);
  double time = 0.0, frequency = bins[0] * bins[0];
  for (const double v : a) time += v * v;
  for (std::size_t k = 1; k < bins.size(); ++k) frequency += 2.0 * bins[k] * bins[k];
  CHECK(frequency / static_cast<double>(n) == Approx(time).epsilon(1e-13));
}

TEST_CASE("A weak signal transformed beside a strong one keeps its digits") {
  const auto weak = noise(100, 2);
  std::vector<double> strong = noise(100, 3);
  for (double& v : strong) v *= 1e200;
  Spectrum spectrum(100);
  std::vector<double> got(51), other(51);
  spectrum.magnitudes(weak, strong, got, other);
  const auto want = slow_magnitudes(weak);
  for (std::size_t k = 0; k < got.size(); ++k) CHECK(std::abs(got[k] - want[k]) < 1e-12);
}

TEST_CASE("A sinusoid reads its amplitude in Hfrq, and in Sh only when it is fast") {
  const std::size_t n = 120;
  const auto wave = [&](double cycles) {
    std::vector<double> out;
    for (std::size_t i = 0; i < n; ++i) {
      out.push_back(500.0 + 13.0 * std::sin(2.0 * std::numbers::pi * cycles *
                                            static_cast<double>(i) / static_cast<double>(n)));
    }
    return motion_trial(out);
  };
  CHECK(feature(wave(7), "Hfrq.M.1") == Approx(13.0).epsilon(1e-12));
  CHECK(feature(wave(7), "Sh.M.1") < 1e-9);
  CHECK(feature(wave(30), "Sh.M.1") < 1e-9);  // fs/4 itself belongs to the lower half
  CHECK(feature(wave(31), "Sh.M.1") == Approx(13.0).epsilon(1e-9));
  const double raw = feature(wave(7), "Hfrq.M.1", {.spectrum = SpectrumScale::magnitude});
  CHECK(raw == Approx(13.0 * n / 2.0).epsilon(1e-12));
}

TEST_CASE("A matrix of trials does not depend on the number of threads and refuses odd ones out") {
  std::vector<Trial> trials;
  for (std::uint64_t i = 0; i < 7; ++i) {
    trials.push_back(motion_trial(noise(50 + i, i)));
    trials.back().file = "t" + std::to_string(i);
  }
  const auto one = build_feature_matrix(trials, {}, 1);
  const auto four = build_feature_matrix(trials, {}, 4);
  REQUIRE(one);
  CHECK(one->values.data() == four->values.data());
  trials[5].phase[0] = Phase::press;
  const auto odd = build_feature_matrix(trials);
  REQUIRE_FALSE(odd);
  CHECK(odd.error().where == "t5");
  CHECK_FALSE(build_feature_matrix({}));
}

TEST_CASE("Windows cut the motion into equal parts that inherit label and group") {
  Trial trial = motion_trial(std::vector<double>{0, 1, 2, 3, 4, 5, 6, 7});
  trial.label = "Denim";
  trial.group = "rep0";
  trial.phase[0] = Phase::press;
  const auto windows = cut_windows(trial, {.window_s = 0.084, .sample_period_s = 0.028});
  REQUIRE(windows);
  REQUIRE(windows->size() == 2);
  CHECK((*windows)[1].counts == std::vector<double>{4, 5, 6});
  CHECK((*windows)[1].group == "rep0");
  CHECK((*windows)[1].label == "Denim");
  CHECK((*windows)[1].file == "trial.csv#1");
  const auto dense =
      cut_windows(trial, {.window_s = 0.084, .step_s = 0.028, .sample_period_s = 0.028});
  CHECK(dense->size() == 5);
}

TEST_CASE("Windows of no duration, or longer than the motion, are refused") {
  const Trial trial = motion_trial(std::vector<double>{0, 1, 2});
  CHECK_FALSE(cut_windows(trial, {.window_s = 1.0, .sample_period_s = 0.0}));
  CHECK_FALSE(cut_windows(trial, {.window_s = -1.0, .sample_period_s = 0.1}));
  CHECK_FALSE(cut_windows(trial, {.window_s = std::nan(""), .sample_period_s = 0.1}));
  CHECK_FALSE(cut_windows(trial, {.window_s = 0.4, .sample_period_s = 0.1}));
}

}  // namespace
}  // namespace weft::classifier
