// Imprints at their limits: the documented value or a clear error, and never a NaN.

#include <catch2/catch.hpp>
#include <limits>

#include "classifier/imprint/scale_features.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::imprint::imprint_extremes_test {
namespace {

const std::vector<double> all_sigmas{0.0, 1e-300, 0.4, 1.0, 2.0, 4.0, 100.0};

std::vector<double> compute_features(const Image& image, const std::vector<double>& sigmas,
                                     const ScaleOptions& base = {}) {
  ScaleOptions options = base;
  options.sigmas = sigmas;
  auto features = ScaleFeatures::make(options);
  REQUIRE(features);
  const auto values = features->extract(image);
  REQUIRE(values);
  for (const double value : *values) REQUIRE(std::isfinite(value));
  return {values->begin(), values->end()};
}

void check_zero(const std::vector<double>& values) {
  for (const double value : values) CHECK(value == 0.0);
}

TEST_CASE("imprints without an interior, constant or saturated, have zeros only") {
  for (const auto& [rows, cols] : {std::pair{1, 1}, {1, 50}, {50, 1}, {2, 2}, {2, 40}}) {
    Image image(static_cast<std::size_t>(rows), static_cast<std::size_t>(cols));
    for (std::size_t i = 0; i < image.data().size(); ++i)
      image.data()[i] = static_cast<double>(i * i % 7);
    check_zero(compute_features(image, all_sigmas));
  }
  for (const double level : {0.0, 0.1, 127.0, -3.7e99})
    check_zero(compute_features(Image(32, 32, level), all_sigmas));
}

TEST_CASE(
    "features of an imprint in another unit are the same, times the unit where they have one") {
  RandomEngine engine(8);
  Image counts(24, 24);
  for (std::size_t i = 0; i < counts.data().size(); ++i)
    counts.data()[i] =
        (i / 4) % 2 == 0 ? 800.0 + static_cast<double>(random_below(engine, 9)) : 0.0;
  const std::vector<bool> has_unit{false, true, true, false, false, true, true, false, true, true};
  for (const double unit : {0x1p-40, 0x1p-60, 0x1p40}) {  // exact
    Image other = counts;
    for (double& value : other.data()) value *= unit;
    for (const double sigma : {0.0, 1.0, 2.0}) {
      const auto expected = compute_features(counts, {sigma}),
                 found = compute_features(other, {sigma});
      REQUIRE(expected[0] > 0.0);
      for (std::size_t k = 0; k < expected.size(); ++k) {
        CAPTURE(unit, sigma, k);
        CHECK(found[k] == Approx(expected[k] * (has_unit[k] ? unit : 1.0)).epsilon(1e-12));
      }
    }
  }
}

TEST_CASE("3 x 3: one taxel has neighbours") {
  Image image(3, 3, 10.0);
  image(1, 1) = 90.0;
  const auto values = compute_features(image, {0.0});
  CHECK(values[7] == 1.0);
  CHECK(values[8] == 80.0);
  CHECK(values[9] == 0.0);
  check_zero({values.begin(), values.begin() + 7});  // its gradient is 0: no edge
}

TEST_CASE("small images at every scale: finite features, and smoothing within what was there") {
  RandomEngine engine(6);
  for (const auto& [rows, cols] : {std::pair{3, 3}, {5, 7}, {7, 5}}) {
    Image image(static_cast<std::size_t>(rows), static_cast<std::size_t>(cols));
    for (double& value : image.data()) value = static_cast<double>(random_below(engine, 128));
    const auto [low, high] = std::minmax_element(image.data().begin(), image.data().end());
    compute_features(image, all_sigmas);
    for (const double sigma : all_sigmas) {
      INFO(rows << " x " << cols << ", sigma " << sigma);
      CHECK(compute_features(image, {sigma}).size() == 10);
      auto filter = GaussianFilter::make(sigma);
      REQUIRE(filter);
      Image smooth;
      filter->apply(image, smooth);
      REQUIRE(smooth.data().size() == image.data().size());
      for (const double value : smooth.data()) {
        CHECK(value >= *low - 1e-9);
        CHECK(value <= *high + 1e-9);
      }
    }
    // A scale larger than the image: hardly any signal and no extremum remain.
    for (const double sigma : {10.0, 100.0, 1000.0}) {
      INFO(rows << " x " << cols << ", sigma " << sigma);
      Image smooth;
      GaussianFilter::make(sigma).value().apply(image, smooth);
      const auto [least, most] = std::minmax_element(smooth.data().begin(), smooth.data().end());
      CHECK(*most - *least < 4.0 / sigma * (*high - *low));
      const auto values = compute_features(image, {sigma});
      CHECK(values[4] == 0.0);
      CHECK(values[7] == 0.0);
    }
  }
}

TEST_CASE("a scale far larger than the image leaves its mean, without an edge of rounding") {
  RandomEngine engine(4);
  Image image(32, 32);
  for (double& value : image.data()) value = static_cast<double>(random_below(engine, 128));
  const auto values = compute_features(image, {1000.0});
  CHECK(values[4] == 0.0);
  CHECK(values[7] == 0.0);
}

TEST_CASE("1024 x 1024 and the largest values stay finite") {
  RandomEngine engine(9);
  Image image(1024, 1024);
  for (double& value : image.data()) value = static_cast<double>(random_below(engine, 128));
  const auto values = compute_features(image, {0.0, 2.0});
  CHECK(values[0] > 1000.0);
  CHECK(values[7] > 10000.0);
  Image huge(16, 16);
  for (double& value : huge.data()) value = random_below(engine, 2) == 0 ? 1e100 : -1e100;
  for (const NoiseForm noise : {NoiseForm::gradient, NoiseForm::literal})
    for (const OrientationSpread spread :
         {OrientationSpread::circular, OrientationSpread::linear}) {
      ScaleOptions options;
      options.noise = noise;
      options.orientation = spread;
      options.thresholds = {0.0, 0.0};
      compute_features(huge, all_sigmas, options);
      Image faint(16, 16);
      for (double& value : faint.data()) value = testing::normal(engine) * 1e-160;
      compute_features(faint, all_sigmas, options);
    }
}

TEST_CASE("a ramp is a ridge only where it runs into the replicated border") {
  Image image(20, 20);
  for (std::size_t r = 0; r < 20; ++r)
    for (std::size_t c = 0; c < 20; ++c) image(r, c) = static_cast<double>(2 * c);
  const auto values = compute_features(image, {0.0});
  CHECK(values[0] == 18.0);  // the last column but one: the border's gradient is half as large
  CHECK(values[1] == 2.0);
  check_zero({values.begin() + 2, values.end()});
}

TEST_CASE("values and settings that mean nothing are refused, with their place") {
  auto features = ScaleFeatures::make({});
  REQUIRE(features);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(),
                           std::numeric_limits<double>::infinity(), -1e101}) {
    Image image(4, 5, 1.0);
    image(2, 3) = bad;
    const auto values = features->extract(image);
    REQUIRE(!values);
    CHECK(values.error().where == "row 2, column 3");
  }
  CHECK(!features->extract(Image()));
  CHECK(features->extract(Image(4, 5, 1.0)));  // it still works
  for (const double sigma : {-1.0, 1001.0, std::numeric_limits<double>::quiet_NaN(),
                             std::numeric_limits<double>::infinity()})
    CHECK(!GaussianFilter::make(sigma));
  const auto refused = [](ScaleOptions options) { return !ScaleFeatures::make(options); };
  CHECK(refused({.sigmas = {}}));
  CHECK(refused({.sigmas = {1.0, 2.0, 1.0}}));
  CHECK(refused({.thresholds = {2.0, 1.0}}));
  CHECK(refused({.thresholds = {-1.0, 1.0}}));
  CHECK(refused({.thresholds = {1.0, std::numeric_limits<double>::quiet_NaN()}}));
}

}  // namespace
}  // namespace weft::classifier::imprint::imprint_extremes_test
