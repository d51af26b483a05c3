#include "sim/plant/imprint/height_map.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "sim/plant/random.hpp"
#include "tests/unit/plant/imprint_support.hpp"

namespace winkler_test {

using namespace weft;
using namespace weft::sim;
using test::spring_pressure_pa;
using test::total_force_n;

namespace {

const double not_a_number = std::numeric_limits<double>::quiet_NaN();
const double inf = std::numeric_limits<double>::infinity();

const SpringLaw rubber = SpringLaw::linear(2e8);
const SpringLaw denim{SpringLaw::Kind::exponential, 5, 60.4e-6};

/// Heights of different kinds: many ties, far below, steep, smooth.
HeightMap random_map(std::uint64_t seed, std::size_t rows, std::size_t cols, int kind) {
  Random random(seed);
  HeightMap map{rows, cols, taxel_spacing_m, {}};
  for (std::size_t i = 0; i < rows * cols; ++i) {
    const double u = random.uniform();
    const double height = kind == 0   ? 1e-3 * u
                          : kind == 1 ? 1e-4 * std::floor(4 * u)
                          : kind == 2 ? -std::exp2(-60 * u)
                                      : 50e-6 * random.gaussian();
    map.height_m.push_back(height);
  }
  return map;
}

/// Force on the whole map with its highest point pressed in by `depth_m`, spring by spring.
double force_at(const HeightMap& map, const SpringLaw& law, double depth_m) {
  const double top = highest_m(map);
  long double sum = 0;
  for (const double h : map.height_m) sum += spring_pressure_pa(law, depth_m + (h - top));
  return static_cast<double>(sum) * map.cell_m2();
}

/// Depth by bisection of the total force: independent of contacts and closed forms.
double depth_by_bisection(const HeightMap& map, const SpringLaw& law, double force_n) {
  double low = 0, high = 1e-6;
  while (force_at(map, law, high) < force_n) high *= 2;
  for (int i = 0; i < 100; ++i) {
    const double middle = 0.5 * (low + high);
    (force_at(map, law, middle) < force_n ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

Imprint pressed(const HeightMap& map, const SpringLaw& law, double force_n) {
  auto imprint = press_winkler(map, law, force_n);
  REQUIRE(imprint.has_value());
  return std::move(*imprint);
}

}  // namespace

TEST_CASE("The depth under a force is the one at which the springs, one by one, carry it") {
  for (const SpringLaw& law : {rubber, denim})
    for (int kind = 0; kind < 4; ++kind)
      for (const double force : {1e-9, 1e-3, 1.0, 20.0, 50.0}) {
        CAPTURE(kind, force, law.length_m);
        const HeightMap map = random_map(17, 13, 29, kind);
        const Imprint imprint = pressed(map, law, force);
        CHECK(imprint.indentation_m == Approx(depth_by_bisection(map, law, force)).epsilon(1e-10));
        CHECK(total_force_n(imprint, map.cell_m2()) == Approx(force).epsilon(1e-12));
        const double top = highest_m(map);
        for (std::size_t i = 0; i < map.height_m.size(); ++i) {
          const double p = spring_pressure_pa(law, imprint.indentation_m + (map.height_m[i] - top));
          REQUIRE(imprint.pressure_pa[i] ==
                  Approx(p).epsilon(1e-9).margin(1e-9 * force / map.cell_m2()));
        }
      }
}

TEST_CASE("Heights that fall off by halves, one spring after another, are solved exactly") {
  // Each pass drops few of them: the sorted method must finish.
  HeightMap map{1, 900, taxel_spacing_m, {}};
  for (int i = 0; i < 900; ++i) map.height_m.push_back(-std::exp2(-i));
  for (const double force : {1e-12, 1e-6, 1e-3, 1.0}) {
    const Imprint imprint = pressed(map, rubber, force);
    CHECK(total_force_n(imprint, map.cell_m2()) == Approx(force).epsilon(1e-12));
    CHECK(imprint.indentation_m == Approx(depth_by_bisection(map, rubber, force)).epsilon(1e-10));
  }
}

TEST_CASE("A plate sinks by F/(n A k), a cloth by lambda ln(1 + F/(A p_s))") {
  const HeightMap plate{32, 32, taxel_spacing_m, std::vector<double>(1024, 0.7)};
  const double area = 1024 * plate.cell_m2();
  const Imprint linear = pressed(plate, rubber, light_press_n);
  CHECK(linear.indentation_m == Approx(light_press_n / area / 2e8).epsilon(1e-13));
  CHECK(linear.contact_fraction == 1);
  const Imprint cloth = pressed(plate, denim, 5);
  CHECK(cloth.indentation_m == Approx(denim.length_m * std::log1p(5 / (area * 5))).epsilon(1e-13));
}

TEST_CASE(
    "Two levels share the load as the closed form has it, before and after the lower touches") {
  HeightMap stairs{1, 2, 1e-3, {0, -1e-3}};  // A = 1e-6 m2, k = 2e8 Pa/m: touches at 0.2 N
  const Imprint before = pressed(stairs, rubber, 0.1);
  CHECK(before.indentation_m == Approx(0.5e-3).epsilon(1e-14));
  CHECK(before.contact_fraction == 0.5);
  const Imprint after = pressed(stairs, rubber, 0.6);
  CHECK(after.indentation_m == Approx((0.6 / (1e-6 * 2e8) + 1e-3) / 2).epsilon(1e-14));
  CHECK(after.contact_fraction == 1);
}

TEST_CASE("The order of the taxels does not matter and heights count only against the highest") {
  const HeightMap map = random_map(4, 16, 16, 0);
  HeightMap moved = map;
  std::reverse(moved.height_m.begin(), moved.height_m.end());
  for (double& h : moved.height_m) h += 0.125;
  const Imprint one = pressed(map, rubber, 2), other = pressed(moved, rubber, 2);
  CHECK(one.indentation_m == Approx(other.indentation_m).epsilon(1e-11));
  for (std::size_t i = 0; i < 256; ++i)
    CHECK(one.pressure_pa[i] == Approx(other.pressure_pa[255 - i]).epsilon(1e-9).margin(1e-3));
}

TEST_CASE(
    "No force leaves no imprint; one taxel, the smallest and the largest forces are carried") {
  for (const SpringLaw& law : {rubber, denim}) {
    const HeightMap map = random_map(5, 8, 8, 0);
    const Imprint none = pressed(map, law, 0);
    CHECK(none.contact_fraction == 0);
    CHECK(*std::max_element(none.pressure_pa.begin(), none.pressure_pa.end()) == 0);
    const HeightMap one{1, 1, 1e-3, {-0.3}};
    for (const double force : {5e-324, 1e-310, 1e-300, 1e-12, 1.0, 1e6}) {
      const Imprint imprint = pressed(one, law, force);
      CHECK(total_force_n(imprint, 1e-6) == Approx(force).epsilon(1e-12).margin(1e-317));
      CHECK(total_force_n(pressed(map, law, force), map.cell_m2()) ==
            Approx(force).epsilon(1e-11).margin(1e-300));
    }
  }
}

TEST_CASE("Maps, forces and laws that cannot be are refused with a sentence") {
  const HeightMap good = random_map(1, 2, 2, 0);
  for (const double bad : {not_a_number, inf, -inf, 1e308, -1e308}) {
    HeightMap map = good;
    map.height_m[2] = bad;
    CHECK_FALSE(press_winkler(map, rubber, 1).has_value());
    map = good;
    map.spacing_m = bad;
    CHECK_FALSE(press_winkler(map, rubber, 1).has_value());
    CHECK_FALSE(press_winkler(good, rubber, bad).has_value());
    CHECK_FALSE(press_winkler(good, {SpringLaw::Kind::linear, bad, 1e-3}, 1).has_value());
    CHECK_FALSE(press_winkler(good, {SpringLaw::Kind::linear, 1e3, bad}, 1).has_value());
  }
  CHECK_FALSE(press_winkler(good, rubber, -1e-9).has_value());
  CHECK_FALSE(press_winkler({}, rubber, 1).has_value());
  CHECK_FALSE(press_winkler({1, 3, 1e-3, {0, 0}}, rubber, 1).has_value());
  CHECK_FALSE(press_winkler({std::size_t{1} << 40, std::size_t{1} << 40, 1e-3, {}}, rubber, 1));
  HeightMap map = good;
  map.height_m[2] = not_a_number;
  const auto refused = press_winkler(map, rubber, 1);
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == Errc::range);
  CHECK(refused.error().where == "height_m[2]");
  CHECK(refused.error().expected == "-1 to 1 m");
  CHECK(refused.error().got == "nan");
}

TEST_CASE("A part of an imprint is cut out with its own contact fraction") {
  const Imprint whole{2, 3, {0, 1, 2, 0, 0, 5}, 1e-3, 0.5};
  const auto part = extract_part(whole, 0, 1, 2, 2);
  REQUIRE(part.has_value());
  CHECK(part->pressure_pa == std::vector<double>{1, 2, 0, 5});
  CHECK(part->contact_fraction == 0.75);
  CHECK_FALSE(extract_part(whole, 1, 0, 2, 3).has_value());
  CHECK_FALSE(extract_part(whole, 0, 0, 0, 1).has_value());
}

}  // namespace winkler_test
