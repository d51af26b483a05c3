#include "recipes/alignment/plane_fit.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace plane_fit_test {

using namespace weft;
using namespace weft::recipes;

namespace {

/// A square grid around (0.07, 0.05) on height = 1 mm + a x + b y.
std::vector<TouchPoint> touches(double a, double b, int side = 3, double span_m = 0.1) {
  std::vector<TouchPoint> points;
  for (int i = 0; i < side; ++i)
    for (int j = 0; j < side; ++j) {
      const Vec2 at{0.07 + span_m * (double(i) / (side - 1) - 0.5),
                    0.05 + span_m * (double(j) / (side - 1) - 0.5)};
      points.push_back({at, 1e-3 + a * at.x_m + b * at.y_m});
    }
  return points;
}

}  // namespace

TEST_CASE("Touches on a plane give its slopes, and no residual") {
  const auto fit = fit_plane(touches(0.03, -0.02), 0);
  REQUIRE(fit);
  CHECK(std::abs(fit->slope_x - 0.03) < 1e-14);
  CHECK(std::abs(fit->slope_y + 0.02) < 1e-14);
  CHECK(fit->residual_rms_m < 1e-16);
  CHECK(fit->height_at({0, 0}) == Approx(1e-3).margin(1e-15));
  CHECK(fit->points == 9);
}

TEST_CASE("Three touches that agree by necessity are as uncertain as the step they are read in") {
  const std::vector<TouchPoint> three{{{0, 0}, 0}, {{0.1, 0}, 1e-3}, {{0, 0.1}, 0}};
  const auto fit = fit_plane(three, 1e-6);
  REQUIRE(fit);
  CHECK(fit->slope_x == Approx(0.01));
  CHECK(fit->residual_rms_m == 0);
  // slope_x = (h2 - h1) / 0.1 m, two independent contact heights of 1 um / sqrt 12 each
  CHECK(fit->slope_x_sd == Approx(std::sqrt(2.0) * 1e-6 / std::sqrt(12.0) / 0.1));
}

TEST_CASE("One touch off the plane shows in the worst residual by its leverage") {
  auto points = touches(0, 0);
  points[4].height_m += 9e-6;  // the middle of a 3 x 3 grid: 1/9 of it lifts the plane
  const auto fit = fit_plane(points, 0);
  REQUIRE(fit);
  CHECK(fit->residual_worst_m == Approx(8e-6));
  CHECK(std::abs(fit->slope_x) < 1e-15);
  CHECK(fit->residual_rms_m == Approx(std::sqrt((64.0 + 8) * 1e-12 / 6)));
}

TEST_CASE("The stated spread of the slopes is the one that noisy touches have") {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 2e-6);
  double sum = 0, stated = 0;
  constexpr int runs = 3000;
  for (int i = 0; i < runs; ++i) {
    auto points = touches(0.01, 0.02);
    for (TouchPoint& p : points) p.height_m += noise(random);
    const auto fit = fit_plane(points, 0);
    REQUIRE(fit);
    sum += (fit->slope_x - 0.01) * (fit->slope_x - 0.01);
    stated += fit->slope_x_sd * fit->slope_x_sd;
  }
  CHECK(std::sqrt(sum / runs) == Approx(2e-6 / std::sqrt(6 * 0.05 * 0.05)).epsilon(0.05));
  CHECK(std::sqrt(stated / runs) == Approx(std::sqrt(sum / runs)).epsilon(0.05));
}

TEST_CASE("Touches that span no plane or are not numbers are refused with a sentence") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<TouchPoint> two{{{0, 0}, 0}, {{0.1, 0}, 0}};
  CHECK(fit_plane(two, 0).error().expected == "at least 3");
  CHECK(fit_plane(two, 0).error().got == "2");
  const std::vector<TouchPoint> line{{{0, 0}, 0}, {{0.05, 0.05}, 0}, {{0.1, 0.1}, 0}};
  CHECK_THAT(fit_plane(line, 0).error().expected, Catch::Contains("plane"));
  const std::vector<TouchPoint> one_place(4, TouchPoint{{0.1, 0.1}, 0});
  CHECK_FALSE(fit_plane(one_place, 0));
  auto bad = touches(0, 0);
  bad[3].height_m = nan;
  CHECK_THAT(fit_plane(bad, 0).error().expected, Catch::Contains("finite"));
  CHECK_FALSE(fit_plane(touches(0, 0), nan));
}

}  // namespace plane_fit_test
