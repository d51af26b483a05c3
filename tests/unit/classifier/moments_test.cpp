// Moments do not depend on the level or on the unit of a signal.

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "classifier/features/feature_matrix.hpp"
#include "classifier/vibro/channel_features.hpp"
#include "tests/unit/classifier/slow_features.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::moments_test {
namespace {

using testing::motion_trial;

// Whole numbers within +-`most`, more of them small than large: skewed.
std::vector<double> whole_numbers(std::size_t count, int most) {
  RandomEngine engine(17);
  std::vector<double> out;
  for (std::size_t i = 0; i < count; ++i) {
    const double u = static_cast<double>(engine() % 1000) / 1000.0;
    out.push_back(std::nearbyint(most * (2.0 * u * u - 1.0)));
  }
  return out;
}

std::vector<double> moved(std::vector<double> signal, double factor, double level) {
  for (double& v : signal) v = factor * v + level;
  return signal;
}

// Features by name without the taxel: of one taxel alone, and of the last of eighteen.
std::array<std::map<std::string, double>, 2> features_of(const std::vector<double>& signal,
                                                         const FeatureOptions& options) {
  std::array<std::map<std::string, double>, 2> out;
  for (const std::size_t taxels : {1U, 18U}) {
    std::vector<std::vector<double>> rows;
    for (const double v : signal) rows.emplace_back(taxels, v);
    const Trial trial = motion_trial(rows);
    const auto values = extract(trial, options);
    REQUIRE(values);
    const FeatureLayout layout(taxels, phases_of(trial));
    for (std::size_t k = 0; k < values->size(); ++k) {
      const FeatureInfo& column = layout.columns()[k];
      if (column.taxel == taxels)
        out[taxels > 1][column.name.substr(0, column.name.find('.'))] = (*values)[k];
    }
  }
  return out;
}

const std::map<std::string, int> powers = {{"var", 2},  {"kurt", 0}, {"skew", 0}, {"range", 1},
                                           {"Hfrq", 1}, {"Sh", 1},   {"m5", 5}};

std::map<std::string, double> expected_of(const std::vector<double>& signal,
                                          const FeatureOptions& options) {
  const auto n = static_cast<double>(signal.size());
  const double m2 = testing::slow_moment(signal, 2);
  auto out = features_of(signal, options)[0];  // range and spectrum, compared elsewhere
  out["var"] = m2 * n / (n - 1);
  out["kurt"] = testing::slow_moment(signal, 4) / (m2 * m2);
  out["m5"] = testing::slow_moment(signal, 5);
  out["skew"] =
      testing::slow_skewness(options.skew == SkewOf::signal ? signal : testing::slow_peaks(signal));
  return out;
}

void check_moved(const std::vector<double>& signal, double factor, double level) {
  for (const SkewOf skew : {SkewOf::signal, SkewOf::peaks}) {
    const FeatureOptions options{.skew = skew};
    const auto expected = expected_of(signal, options);
    for (const auto& found : features_of(moved(signal, factor, level), options))
      for (const auto& [name, power] : powers) {
        CAPTURE(factor, level, name);
        const double unit = std::pow(factor, power);  // may be subnormal
        // the spectrum's own rounding is relative to its largest bin
        const double slack = name == "Sh" ? 1e-9 * std::abs(expected.at("Hfrq")) * unit : 0.0;
        CHECK(found.at(name) == Approx(expected.at(name) * unit)
                                    .epsilon(1e-9)
                                    .margin(slack + std::numeric_limits<double>::min()));
      }
  }
}

}  // namespace

TEST_CASE("a level of 1e15 takes nothing from the moments of whole numbers") {
  const std::vector<double> signal = whole_numbers(1000, 10);
  for (const double level : {0.0, 4096.0, 1e9, 1e12, 1e15, -1e15}) check_moved(signal, 1.0, level);
}

TEST_CASE("many samples at a level of 1e12 have the sign of their skewness") {
  check_moved(whole_numbers(300'000, 2), 1.0, 1e12);
}

TEST_CASE("moments do not depend on the unit") {
  const std::vector<double> signal = whole_numbers(500, 40);
  for (const double unit : {1e-12, 1e-15, 1e-60, 0x1p-220, 0x1p-400, 1e20})
    check_moved(signal, unit, 0.0);
  const std::vector<double> farad = moved(signal, 1e-17, 0.8e-12);  // rounded to 1e-28
  const auto found = features_of(farad, {})[0];
  CHECK(found.at("var") == Approx(1e-34 * expected_of(signal, {}).at("var")).epsilon(1e-6));
  CHECK(found.at("kurt") == Approx(expected_of(signal, {}).at("kurt")).epsilon(1e-6));
}

TEST_CASE("a constant of any size and length has no spread, nor has one that rounding moves") {
  for (const double level : {0.1, 0.8e-12, 1e15 / 3, -1e-90}) {
    std::vector<double> signal(300'000, level);
    for (const bool rounded : {false, true}) {
      if (rounded) signal[7] = std::nextafter(level, HUGE_VAL);
      for (const auto& found : features_of(signal, {})) {
        CAPTURE(level, rounded);
        for (const char* name : {"var", "skew", "m5", "Hfrq", "Sh"}) CHECK(found.at(name) == 0.0);
        CHECK(found.at("kurt") == 3.0);
      }
    }
  }
}

TEST_CASE("differences of phases at a level of 1e15 have the digits that the level leaves") {
  Trial trial = motion_trial(std::vector<double>(3001, 1e15));
  for (std::size_t i = 0; i < 2000; ++i) {
    trial.phase[i] = i < 1000 ? Phase::rest : Phase::press;
    trial.counts[i] += i < 1000 ? 40.0 : 8.0;
  }
  const auto found = extract(trial);
  REQUIRE(found);
  CHECK((*found)[1] == 32.0);
}

TEST_CASE("sound at a level of 1e15 has its mean and deviation") {
  const std::vector<double> signal = whole_numbers(300'000, 10);
  for (const double level : {0.0, 1e12, 1e15}) {
    vibro::ChannelExtractor extractor(8000.0);
    const auto found = extractor.figures(moved(signal, 1.0, level));
    REQUIRE(found);
    const auto get = [&](vibro::FrameFeature f) { return (*found)[static_cast<std::size_t>(f)]; };
    CHECK(get(vibro::FrameFeature::std) ==
          Approx(std::sqrt(testing::slow_moment(signal, 2))).epsilon(1e-9));
    CHECK(get(vibro::FrameFeature::mean) - level ==
          Approx(testing::slow_mean(signal)).margin(level * 0x1p-53 + 1e-12));
  }
}

}  // namespace weft::classifier::moments_test
