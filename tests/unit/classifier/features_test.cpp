#include <catch2/catch.hpp>
#include <limits>
#include <numbers>

#include "classifier/features/feature_matrix.hpp"
#include "tests/unit/classifier/features_support.hpp"
#include "tests/unit/classifier/slow_features.hpp"

namespace weft::classifier::features_test {
namespace {

using testing::feature;
using testing::motion_trial;
using testing::noise;
using testing::relative_difference;
using testing::slide;

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

TEST_CASE("A feature of a phase that was not recorded is absent, not zero") {
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
  const Trial trial = motion_trial(std::vector<double>{0, 0, 0, 0, 1});
  CHECK(feature(trial, "m5.M.1") == Approx(p * std::pow(q, 5) - q * std::pow(p, 5)).epsilon(1e-14));
  CHECK(feature(trial, "skew.M.1", {.skew = SkewOf::signal}) ==
        Approx((q - p) / std::sqrt(p * q)).epsilon(1e-14));
}

TEST_CASE("A large offset does not change the moments about the mean") {
  const std::vector<double> small = {0, 1, 0, 2, 1, 5, 0, 1};
  std::vector<double> high = small;
  for (double& v : high) v += 1e9;
  const Trial low = motion_trial(small), far = motion_trial(high);
  CHECK(feature(far, "var.M.1") == feature(low, "var.M.1"));
  CHECK(feature(far, "m5.M.1") == Approx(feature(low, "m5.M.1")).epsilon(1e-6));
}

TEST_CASE("A flat top is one peak, end points are none") {
  // peaks 3, 4, 7: mean 14/3, deviations -5/3, -2/3, 7/3
  const Trial trial = motion_trial(std::vector<double>{9, 1, 3, 3, 3, 1, 2, 2, 4, 4, 0, 7, 5, 8});
  const double m2 = (25.0 + 4.0 + 49.0) / 27.0, m3 = (-125.0 - 8.0 + 343.0) / 81.0;
  CHECK(feature(trial, "skew.M.1") == Approx(m3 / std::pow(m2, 1.5)).epsilon(1e-14));
  CHECK(testing::slow_peaks({9, 1, 3, 3, 3, 1, 2, 2, 4, 4, 0, 7, 5, 8}) ==
        std::vector<double>{3, 4, 7});
  // two peaks have no skewness
  CHECK(feature(motion_trial(std::vector<double>{0, 1, 0, 5, 0}), "skew.M.1") == 0.0);
}

TEST_CASE("Skewness of the peaks is of the peaks, with the option of the signal's") {
  const std::vector<double> signal = {0, 1, 0, 1, 0, 4, 0};  // peaks 1, 1, 4
  const Trial trial = motion_trial(signal);
  CHECK(feature(trial, "skew.M.1") == Approx(std::sqrt(0.5)).epsilon(1e-14));
  const double of_signal = feature(trial, "skew.M.1", {.skew = SkewOf::signal});
  CHECK(of_signal == Approx(testing::slow_skewness(signal)).epsilon(1e-14));
}

TEST_CASE("The mode is the smallest of the most frequent values, on the grid of its bin") {
  const auto mode = [](const std::vector<double>& signal, double bin) {
    return feature(motion_trial(signal), "mode.M.1", {.mode_bin_counts = bin});
  };
  CHECK(mode({5, 3, 3, 5, 9}, 1.0) == 3.0);
  CHECK(mode({0.9, 1.1, 7.0, 1.2}, 1.0) == 1.0);
  CHECK(mode({11, 12, 28}, 10.0) == 10.0);
  CHECK(mode({65535, 0, 65535}, 1.0) == 65535.0);
  CHECK(mode({-4, -4, 1e9, 1e9, 2}, 1.0) == -4.0);
  CHECK(mode({-4, 1e9, 1e9, 2}, 1.0) == 1e9);  // too far apart to count: sorted
  CHECK(mode({1e-20, 2e-20, 2e-20, 1.0}, 1e-20) == 2e-20);
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

std::vector<double> motion_of(const Trial& trial, std::size_t taxel) {
  std::vector<double> out;
  for (std::size_t i = 0; i < trial.samples(); ++i)
    if (trial.phase[i] == Phase::motion) out.push_back(trial.row(i)[taxel]);
  return out;
}

TEST_CASE("Every feature of every taxel equals its definition, with one taxel to thirty-five") {
  for (const std::size_t taxels : {1U, 2U, 9U, 16U, 17U, 35U}) {
    for (const std::size_t motion : {4U, 37U, 100U, 127U}) {
      INFO(taxels << " taxels, " << motion << " samples");
      const Trial trial = slide(taxels, motion, taxels + motion);
      const auto got = extract(trial);
      REQUIRE(got);
      REQUIRE(got->size() == 3 + 12 * taxels);
      double worst = 0.0;
      for (std::size_t k = 0; k < taxels; ++k) {
        const auto want = testing::slow_features(motion_of(trial, k));
        for (std::size_t b = 0; b < want.size(); ++b) {
          const double have = (*got)[3 + b * taxels + k];
          // odd moments may cancel: compared with the size of their terms
          const double floor = b == 6 ? 1.0 : b == 9 ? std::pow(want[7], 5) : 0.0;
          worst = std::max(worst, std::abs(have - want[b]) / std::max(std::abs(want[b]), floor));
        }
      }
      CHECK(worst < 1e-12);
    }
  }
}

TEST_CASE("A matrix of trials does not depend on the number of threads and refuses odd ones out") {
  std::vector<Trial> trials;
  for (std::uint64_t i = 0; i < 7; ++i) {
    trials.push_back(motion_trial(noise(50 + i, i)));
    trials.back().file = std::to_string(i).insert(0, 1, 't');
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

}  // namespace
}  // namespace weft::classifier::features_test
