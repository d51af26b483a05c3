// Smoothing, edges, extrema and the ten numbers of an imprint against closed forms.

#include <catch2/catch.hpp>
#include <numeric>

#include "classifier/imprint/scale_features.hpp"
#include "tests/unit/classifier/support.hpp"

namespace weft::classifier::imprint::imprint_features_test {
namespace {

Image noise_image(std::size_t rows, std::size_t cols, double deviation, std::uint64_t seed) {
  RandomEngine engine(seed);
  Image out(rows, cols);
  for (double& value : out.data()) value = deviation * testing::normal(engine);
  return out;
}

Image step_image(std::size_t rows, std::size_t cols, double height) {
  Image out(rows, cols);
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t c = cols / 2; c < cols; ++c) out(r, c) = height;
  return out;
}

GaussianFilter filter_of(double sigma) {
  auto out = GaussianFilter::make(sigma);
  REQUIRE(out);
  return std::move(*out);
}

Image smoothed(const Image& image, double sigma) {
  Image out;
  filter_of(sigma).apply(image, out);
  return out;
}

ScaleFeatures features_at(std::vector<double> sigmas, Form form = Form::full) {
  ScaleOptions options;
  options.sigmas = std::move(sigmas);
  options.form = form;
  auto out = ScaleFeatures::make(options);
  REQUIRE(out);
  return std::move(*out);
}

double value_of(ScaleFeatures& features, const Image& image, const std::string& name) {
  const auto values = features.extract(image);
  REQUIRE(values);
  const auto at = std::find(features.names().begin(), features.names().end(), name);
  REQUIRE(at != features.names().end());
  return (*values)[static_cast<std::size_t>(at - features.names().begin())];
}

TEST_CASE("an impulse becomes the product of two kernels of four deviations") {
  for (const double sigma : {0.3, 1.0, 2.5}) {
    const GaussianFilter filter = filter_of(sigma);
    const auto w = filter.weights();
    CHECK(w.size() == static_cast<std::size_t>(std::ceil(4 * sigma)) + 1);
    CHECK(2 * std::accumulate(w.begin() + 1, w.end(), 0.0) + w[0] == Approx(1).epsilon(1e-15));
    CHECK(w[1] / w[0] == Approx(std::exp(-0.5 / (sigma * sigma))).epsilon(1e-14));
    Image image(41, 37);
    image(20, 18) = 3.0;
    const Image out = smoothed(image, sigma);
    for (std::size_t r = 0; r < 41; ++r)
      for (std::size_t c = 0; c < 37; ++c) {
        const std::size_t down = r > 20 ? r - 20 : 20 - r, across = c > 18 ? c - 18 : 18 - c;
        const double expected =
            down < w.size() && across < w.size() ? 3.0 * w[down] * w[across] : 0.0;
        CHECK(out(r, c) == Approx(expected).epsilon(1e-14));
      }
  }
}

TEST_CASE("a constant image stays constant to the last bit, a mirrored one mirrored") {
  for (const double sigma : {0.5, 1.0, 3.0, 40.0}) {
    const Image flat = smoothed(Image(9, 14, 0.1), sigma);
    for (const double value : flat.data()) CHECK(value == flat(0, 0));
    const Image image = noise_image(12, 17, 5.0, 3), out = smoothed(image, sigma);
    Image mirrored(12, 17);
    for (std::size_t r = 0; r < 12; ++r)
      for (std::size_t c = 0; c < 17; ++c) mirrored(r, c) = image(11 - r, 16 - c);
    const Image back = smoothed(mirrored, sigma);
    for (std::size_t r = 0; r < 12; ++r)
      for (std::size_t c = 0; c < 17; ++c) CHECK(back(r, c) == out(11 - r, 16 - c));
  }
}

TEST_CASE("the noise estimate is the deviation of the gradient that white noise makes") {
  for (const double sigma : {0.0, 1.0, 3.0}) {
    const GaussianFilter filter = filter_of(sigma);
    const Image image = smoothed(noise_image(400, 400, 7.0, 11), sigma);
    Gradient slope;
    gradient(image, slope);
    double square = 0;
    for (const double x : slope.x.data()) square += x * x;
    const double truth = std::sqrt(square / 160000.0);
    CHECK(noise_estimate(image, filter.weights(), NoiseForm::gradient) ==
          Approx(truth).epsilon(0.03));
  }
}

// Beyond about 8 taxels the limit of the window at four deviations matters: its jump does not
// shrink with the third derivative.
TEST_CASE("for larger scales the noise factor tends to 2 sigma^2 / sqrt(15)") {
  const Image image = smoothed(noise_image(64, 64, 1.0, 5), 5.0);
  const GaussianFilter filter = filter_of(5.0);
  CHECK(noise_estimate(image, filter.weights(), NoiseForm::gradient) /
            noise_estimate(image, filter.weights(), NoiseForm::literal) ==
        Approx(2.0 * 25.0 / std::sqrt(15.0)).epsilon(0.02));
}

TEST_CASE("third differences do not see a parabola, and see a cubic as six") {
  Image image(8, 9);
  for (std::size_t r = 0; r < 8; ++r)
    for (std::size_t c = 0; c < 9; ++c)
      image(r, c) = static_cast<double>(r * r) + 3.0 * static_cast<double>(c * c);
  const std::vector<double> raw{1.0};
  CHECK(noise_estimate(image, raw, NoiseForm::literal) == 0.0);
  for (std::size_t r = 0; r < 8; ++r)
    for (std::size_t c = 0; c < 9; ++c) image(r, c) = std::pow(static_cast<double>(c), 3.0);
  // 8 rows of 6 differences along a row, each 6; 5 x 9 down a column, each 0.
  CHECK(noise_estimate(image, raw, NoiseForm::literal) ==
        Approx(std::sqrt(48.0 * 36.0 / (48.0 + 45.0))).epsilon(1e-14));
}

TEST_CASE("a step is found once across, at its place, with the kernel's weight as its strength") {
  ScaleFeatures features = features_at({1.0});
  const Image image = step_image(32, 32, 100.0);
  const auto w = filter_of(1.0);
  // Central difference of the running sum of the kernel: (w0 + w1) / 2 of the height.
  CHECK(value_of(features, image, "edges.mean@1") ==
        Approx(100.0 * (w.weights()[0] + w.weights()[1]) / 2.0).epsilon(1e-13));
  CHECK(value_of(features, image, "edges.n@1") == 30.0);
  CHECK(value_of(features, image, "edges.std@1") < 1e-12);
  CHECK(value_of(features, image, "edges.ori@1") < 1e-12);
  CHECK(value_of(features, image, "min.n@1") == 0.0);
}

TEST_CASE("weak edges live by strong ones that they touch") {
  Gradient slope{Image(5, 9), Image(5, 9), Image(5, 9)};
  const auto put = [&](std::size_t r, std::size_t c, double strength) {
    slope.x(r, c) = slope.strength(r, c) = strength;
  };
  put(1, 1, 2.0);  // strong
  put(2, 2, 1.5);  // touches it by a corner
  put(3, 2, 1.3);  // touches that
  put(1, 6, 1.5);  // alone
  put(3, 6, 1.1);  // too weak
  StepEdges edges;
  const auto& found = edges.find(slope, 1.0, 127.0, {});
  REQUIRE(found.size() == 3);
  CHECK((found[0].row == 1 && found[0].col == 1 && found[0].strength == 2.0));
  CHECK((found[1].row == 2 && found[1].col == 2));
  CHECK((found[2].row == 3 && found[2].col == 2));
}

TEST_CASE("a ridge two taxels wide counts once, and one that runs at a slant is interpolated") {
  Gradient slope{Image(3, 6), Image(3, 6), Image(3, 6)};
  slope.x(1, 2) = slope.strength(1, 2) = slope.x(1, 3) = slope.strength(1, 3) = 5.0;
  StepEdges edges;
  auto found = edges.find(slope, 1.0, 127.0, {});
  REQUIRE(found.size() == 1);
  CHECK(found[0].col == 3);  // larger than the next, not smaller than the previous one
  Gradient slant{Image(3, 3), Image(3, 3), Image(3, 3)};
  slant.x(1, 1) = 4.0;
  slant.y(1, 1) = 3.0;
  slant.strength(1, 1) = 5.0;
  slant.strength(1, 2) = 4.0;  // ahead: a quarter of this and three quarters of the corner
  slant.strength(2, 2) = 5.4;  // 0.25 x 4 + 0.75 x 5.4 = 5.05
  CHECK(edges.find(slant, 1.0, 127.0, {}).empty());
  slant.strength(2, 2) = 5.3;  // 4.975
  CHECK(edges.find(slant, 1.0, 127.0, {}).size() == 1);
}

TEST_CASE("extrema are strict, interior and measured against their ring") {
  Image image(7, 7, 10.0);
  image(2, 2) = 18.0;
  image(4, 4) = 2.0;
  image(0, 6) = 99.0;                // on the border
  image(2, 5) = image(3, 5) = 30.0;  // a plateau of two
  Extrema found;
  find_extrema(image, found);
  REQUIRE(found.maxima.size() == 1);
  REQUIRE(found.minima.size() == 1);
  CHECK(found.maxima[0] == 8.0);
  CHECK(found.minima[0] == 10.5);  // its ring has one of the 30 values: 12.5 on average
}

TEST_CASE("orientations are spread modulo pi, or as plain angles where asked") {
  const auto edge = [](double angle) {
    return EdgeTaxel{0, 0, 2.0 * std::cos(angle), 2.0 * std::sin(angle), 2.0};
  };
  const std::vector<EdgeTaxel> opposite{edge(0.3), edge(0.3 - M_PI)};
  CHECK(orientation_spread(opposite, OrientationSpread::circular) < 1e-15);
  CHECK(orientation_spread(opposite, OrientationSpread::linear) == Approx(M_PI / 2));
  // Two directions +-a about 1.0: R = cos 2a.
  for (const double a : {1e-9, 1e-3, 0.2}) {
    const std::vector<EdgeTaxel> pair{edge(1.0 + a), edge(1.0 - a)};
    CHECK(
        orientation_spread(pair, OrientationSpread::circular) ==
        Approx(std::sqrt(-2.0 * std::log1p(-2.0 * std::pow(std::sin(a), 2))) / 2.0).epsilon(1e-6));
  }
  // All directions equally often: R at least 1/n.
  std::vector<EdgeTaxel> all;
  for (int k = 0; k < 8; ++k) all.push_back(edge(k * M_PI / 8));
  CHECK(orientation_spread(all, OrientationSpread::circular) ==
        Approx(std::sqrt(2.0 * std::log(8.0)) / 2.0));
}

TEST_CASE("names contain feature and scale; the short form omits three") {
  CHECK(features_at({0.0, 2.5}).names().size() == 20);
  CHECK(features_at({0.0, 2.5}).names()[11] == "edges.mean@2.5");
  CHECK(features_at({3.0}, Form::brief).names() ==
        std::vector<std::string>{"edges.n@3", "edges.mean@3", "edges.std@3", "min.n@3", "min.std@3",
                                 "max.n@3", "max.std@3"});
  ScaleFeatures whole = features_at({1.0}), brief = features_at({1.0}, Form::brief);
  const Image image = noise_image(20, 20, 9.0, 2);
  for (const auto& name : brief.names())
    CHECK(value_of(whole, image, name) == value_of(brief, image, name));
}

}  // namespace
}  // namespace weft::classifier::imprint::imprint_features_test
