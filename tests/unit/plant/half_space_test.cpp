#include "sim/plant/imprint/half_space.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/plant/random.hpp"
#include "tests/unit/plant/imprint_support.hpp"

namespace half_space_test {

using namespace weft;
using namespace weft::sim;
using test::total_force_n;

namespace {

HeightMap map_of(std::size_t side, double spacing_m, double (*height)(double x, double y)) {
  HeightMap map{side, side, spacing_m, {}};
  const double middle = (static_cast<double>(side) - 1) / 2;
  for (std::size_t r = 0; r < side; ++r)
    for (std::size_t c = 0; c < side; ++c)
      map.height_m.push_back(height((static_cast<double>(c) - middle) * spacing_m,
                                    (static_cast<double>(r) - middle) * spacing_m));
  return map;
}

HalfSpace array_of(std::size_t rows, std::size_t cols, double spacing_m,
                   const HalfSpaceParams& params = {}) {
  auto made = HalfSpace::make(rows, cols, spacing_m, params);
  REQUIRE(made.has_value());
  return std::move(*made);
}

constexpr double radius = 20e-3;
constexpr double punch = 8e-3;

double sphere(double x, double y) {
  return -(x * x + y * y) / (2 * radius);  // Hertz's paraboloid
}
double flat_punch(double x, double y) {
  return std::hypot(x, y) <= punch ? 0 : -0.1;
}

/// Largest violations of the contact conditions, with displacements by direct summation.
struct Violation {
  double touching = 0;  // |gap| under load
  double apart = 0;     // overlap out of contact
};
Violation violation(const HeightMap& map, const Imprint& imprint, double modulus_pa) {
  const double top = highest_m(map);
  Violation worst;
  for (std::size_t i = 0; i < map.height_m.size(); ++i) {
    double u = 0;
    for (std::size_t j = 0; j < map.height_m.size(); ++j) {
      const double dx = static_cast<double>(i % map.cols) - static_cast<double>(j % map.cols);
      const double dy = static_cast<double>(i / map.cols) - static_cast<double>(j / map.cols);
      u += imprint.pressure_pa[j] *
           love_influence(dx * map.spacing_m, dy * map.spacing_m, map.spacing_m) / modulus_pa;
    }
    const double gap = u - (imprint.indentation_m + map.height_m[i] - top);
    if (imprint.pressure_pa[i] > 0)
      worst.touching = std::max(worst.touching, std::abs(gap));
    else
      worst.apart = std::max(worst.apart, -gap);
  }
  return worst;
}

}  // namespace

TEST_CASE("Love's influence is the integral of 1/r over the square") {
  const double a = 0.28e-3;
  // At the own centre: 4 a ln(1 + sqrt 2)/pi; far away: a^2/(pi r).
  CHECK(love_influence(0, 0, a) ==
        Approx(4 * a * std::log(1 + std::numbers::sqrt2) / std::numbers::pi).epsilon(1e-14));
  const double far = 100 * a;
  CHECK(love_influence(0, far, a) == Approx(a * a / (std::numbers::pi * far)).epsilon(1e-5));
  double sum = 0;  // midpoint rule, at a neighbour
  constexpr int n = 200;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      sum += 1 / std::hypot(a - a * ((i + 0.5) / n - 0.5), 2 * a - a * ((j + 0.5) / n - 0.5));
  CHECK(love_influence(a, 2 * a, a) ==
        Approx(sum * a * a / (n * n) / std::numbers::pi).epsilon(1e-5));
}

TEST_CASE("The convolution is the direct sum on any size of array") {
  for (const auto& [rows, cols] : {std::pair{1, 1}, {1, 7}, {5, 3}, {16, 16}, {9, 33}}) {
    const auto n = static_cast<std::size_t>(rows * cols);
    Random random(7);
    std::vector<double> kernel(n), image(n), out;
    for (double& k : kernel) k = random.uniform(-1, 1);
    for (double& v : image) v = random.uniform(-1, 1);
    EvenConvolution convolution(static_cast<std::size_t>(rows), static_cast<std::size_t>(cols),
                                kernel);
    convolution.apply(image, out);
    for (int i = 0; i < rows * cols; ++i) {
      double direct = 0;
      for (int j = 0; j < rows * cols; ++j)
        direct += image[static_cast<std::size_t>(j)] *
                  kernel[static_cast<std::size_t>(std::abs(i / cols - j / cols) * cols +
                                                  std::abs(i % cols - j % cols))];
      CHECK(out[static_cast<std::size_t>(i)] == Approx(direct).margin(1e-12));
    }
  }
}

TEST_CASE("A sphere has indentation, contact radius and pressure of Hertz") {
  const HalfSpaceParams params;
  for (const double force : {light_press_n, heavy_press_n}) {
    const HeightMap map = map_of(128, taxel_spacing_m, sphere);
    const auto imprint = array_of(128, 128, taxel_spacing_m, params).press(map, force);
    REQUIRE(imprint.has_value());
    const double e = params.modulus_pa;
    const double depth = std::cbrt(9 * force * force / (16 * e * e * radius));
    const double contact = std::sqrt(radius * depth);
    const double peak = 3 * force / (2 * std::numbers::pi * contact * contact);
    CHECK(imprint->indentation_m == Approx(depth).epsilon(2e-3));
    const double area = imprint->contact_fraction * 128 * 128 * map.cell_m2();
    CHECK(std::sqrt(area / std::numbers::pi) == Approx(contact).epsilon(1e-2));
    const double middle = imprint->pressure_pa[64 * 128 + 64];
    CHECK(middle == Approx(peak).epsilon(3e-3));
    CHECK(total_force_n(*imprint, map.cell_m2()) == Approx(force).epsilon(1e-12));
  }
}

TEST_CASE("The depth converges to Hertz's as the grid is refined") {
  const double force = 20, e = HalfSpaceParams{}.modulus_pa;
  const double depth = std::cbrt(9 * force * force / (16 * e * e * radius));
  double last = 1;
  for (const std::size_t side : {16U, 32U, 64U, 128U}) {
    const double spacing = 16e-3 / static_cast<double>(side);
    const auto imprint = array_of(side, side, spacing).press(map_of(side, spacing, sphere), force);
    REQUIRE(imprint.has_value());
    const double error = std::abs(imprint->indentation_m / depth - 1);
    CHECK(error < 0.6 * last);
    last = error;
  }
  CHECK(last < 1e-3);
}

TEST_CASE(
    "A flat round punch has depth F/(2 a E*), half the mean pressure at its centre, a steep edge") {
  const HeightMap map = map_of(128, taxel_spacing_m, flat_punch);
  const HalfSpaceParams params;
  const auto imprint = array_of(128, 128, taxel_spacing_m, params).press(map, 20);
  REQUIRE(imprint.has_value());
  CHECK(imprint->indentation_m == Approx(20 / (2 * punch * params.modulus_pa)).epsilon(1e-2));
  const double mean = 20 / (std::numbers::pi * punch * punch);
  CHECK(imprint->pressure_pa[64 * 128 + 64] == Approx(mean / 2).epsilon(2e-2));
  const auto edge = static_cast<std::size_t>(64 + punch / taxel_spacing_m - 1);
  CHECK(imprint->pressure_pa[64 * 128 + edge] > 1.5 * mean);
}

TEST_CASE("Contact conditions hold by direct summation on rough maps") {
  for (const double force : {1e-3, 0.5, 20.0}) {
    Random random(3);
    HeightMap map{24, 31, taxel_spacing_m, {}};
    for (std::size_t i = 0; i < map.rows * map.cols; ++i)
      map.height_m.push_back(0.2e-3 * random.gaussian());
    const auto imprint = array_of(24, 31, taxel_spacing_m).press(map, force);
    REQUIRE(imprint.has_value());
    const Violation worst = violation(map, *imprint, HalfSpaceParams{}.modulus_pa);
    CHECK(worst.touching < 1e-7 * imprint->indentation_m);
    CHECK(worst.apart < 1e-7 * imprint->indentation_m);
    CHECK(total_force_n(*imprint, map.cell_m2()) == Approx(force).epsilon(1e-12));
    CHECK(imprint->contact_fraction > 0);
  }
}

TEST_CASE(
    "A mirrored map leaves a mirrored imprint, and a face without relief peaks at its edges") {
  Random random(11);
  HeightMap map{20, 20, taxel_spacing_m, {}}, mirrored = map;
  for (int i = 0; i < 400; ++i) map.height_m.push_back(random.uniform(0, 1e-3));
  for (std::size_t i = 0; i < 400; ++i)
    mirrored.height_m.push_back(map.height_m[i / 20 * 20 + 19 - i % 20]);
  HalfSpace array = array_of(20, 20, taxel_spacing_m);
  const auto one = array.press(map, 5), other = array.press(mirrored, 5);
  REQUIRE((one.has_value() && other.has_value()));
  for (std::size_t i = 0; i < 400; ++i)
    CHECK(one->pressure_pa[i] == Approx(other->pressure_pa[i / 20 * 20 + 19 - i % 20])
                                     .margin(1e-6 * heavy_press_n / map.cell_m2() / 400));

  const auto flat = array.press({20, 20, taxel_spacing_m, std::vector<double>(400, 0.3e-3)}, 5);
  REQUIRE(flat.has_value());
  CHECK(flat->contact_fraction == 1);
  CHECK(flat->pressure_pa[0] > 2 * flat->pressure_pa[210]);
}

TEST_CASE("Small arrays do not stop before the contact is level and nothing overlaps") {
  // Cases in which one taxel or a level contact gives no direction; depths of up to a hundred
  // thousand times the heights, and vice versa.
  for (std::uint64_t trial = 0; trial < 6'000; ++trial) {
    Random random(trial);
    const std::size_t rows = 1 + random.bits() % 4, cols = 1 + random.bits() % 4;
    const double scale_m = std::pow(10, random.uniform(-9, -3));
    const auto kind = random.bits() % 3;
    HeightMap map{rows, cols, taxel_spacing_m, {}};
    for (std::size_t i = 0; i < rows * cols; ++i) {
      const double u = random.uniform();
      map.height_m.push_back(scale_m * (kind == 0   ? u
                                        : kind == 1 ? std::pow(u, 8)
                                                    : std::exp(-12 * u)));
    }
    const double force = std::pow(10, random.uniform(-6, 2));
    HalfSpace space = array_of(rows, cols, taxel_spacing_m);
    const auto imprint = space.press(map, force);
    CAPTURE(trial, rows, cols, scale_m, kind, force);
    REQUIRE(imprint.has_value());
    const Violation worst = violation(map, *imprint, HalfSpaceParams{}.modulus_pa);
    REQUIRE(worst.touching < 1e-7 * imprint->indentation_m);
    REQUIRE(worst.apart < 1e-7 * imprint->indentation_m);
  }
}

TEST_CASE("One taxel, no force and the smallest forces") {
  HalfSpace one = array_of(1, 1, taxel_spacing_m);
  const auto pressed = one.press({1, 1, taxel_spacing_m, {-0.2e-3}}, 10);
  REQUIRE(pressed.has_value());
  const double pressure = 10 / (taxel_spacing_m * taxel_spacing_m);
  CHECK(pressed->pressure_pa[0] == Approx(pressure).epsilon(1e-14));
  CHECK(pressed->indentation_m ==
        Approx(pressure * love_influence(0, 0, taxel_spacing_m) / HalfSpaceParams{}.modulus_pa)
            .epsilon(1e-12));
  HalfSpace array = array_of(16, 16, taxel_spacing_m);
  const HeightMap map = map_of(16, taxel_spacing_m, sphere);
  for (const double force : {0.0, 5e-324, 1e-310, 1e-30, 1e-9, 1e6}) {
    const auto imprint = array.press(map, force);
    REQUIRE(imprint.has_value());
    CHECK(total_force_n(*imprint, map.cell_m2()) == Approx(force).epsilon(1e-9).margin(1e-100));
    CHECK(std::isfinite(imprint->indentation_m));
  }
}

TEST_CASE("A half-space that cannot be is refused with a sentence") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {nan, inf, -inf, 1e308, -1.0, 0.0, 1e-310}) {
    CHECK_FALSE(HalfSpace::make(4, 4, bad, {}).has_value());
    CHECK_FALSE(HalfSpace::make(4, 4, 1e-3, {.modulus_pa = bad}).has_value());
    CHECK_FALSE(HalfSpace::make(4, 4, 1e-3, {.tolerance = bad}).has_value());
  }
  CHECK_FALSE(HalfSpace::make(0, 4, 1e-3, {}).has_value());
  CHECK_FALSE(HalfSpace::make(1 << 12, 1 << 11, 1e-3, {}).has_value());
  CHECK_FALSE(HalfSpace::make(4, 4, 1e-3, {.iteration_limit = 0}).has_value());
  HalfSpace array = array_of(4, 4, 1e-3);
  for (const double bad : {nan, inf, -1.0, 1e308}) {
    CHECK_FALSE(array.press({4, 4, 1e-3, std::vector<double>(16, 0.0)}, bad).has_value());
    if (bad != -1.0)
      CHECK_FALSE(array.press({4, 4, 1e-3, std::vector<double>(16, bad)}, 1).has_value());
  }
  const auto other = array.press({2, 8, 1e-3, std::vector<double>(16, 0.0)}, 1);
  REQUIRE_FALSE(other.has_value());
  CHECK(other.error().code == Errc::range);
  CHECK(other.error().where == "map");
  CHECK(other.error().expected == "4 x 4");
  CHECK(other.error().got == "2 x 8");
  auto impatient = HalfSpace::make(32, 32, 1e-3, {.tolerance = 1e-12, .iteration_limit = 2});
  REQUIRE(impatient.has_value());
  CHECK(impatient->press(map_of(32, 1e-3, sphere), 5).error().code == Errc::timeout);
}

}  // namespace half_space_test
