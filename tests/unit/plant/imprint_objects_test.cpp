#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <set>

#include "sim/plant/imprint/height_map.hpp"
#include "sim/plant/imprint/objects.hpp"
#include "tests/unit/plant/imprint_support.hpp"

namespace imprint_objects_test {

using namespace weft;
using namespace weft::sim;
using test::spring_pressure_pa;
using test::total_force_n;

namespace {

const double not_a_number = std::numeric_limits<double>::quiet_NaN();
const double inf = std::numeric_limits<double>::infinity();

HeightMap placed(const ObjectSpec& object, std::uint64_t seed = 1, std::size_t side = 128) {
  auto map = place(object, side, side, taxel_spacing_m, seed);
  REQUIRE(map.has_value());
  return std::move(*map);
}

ObjectSpec object_of(std::string_view name) {
  const ObjectSpec* found = find_object(name);
  REQUIRE(found != nullptr);
  return *found;
}

Imprint pressed(const ObjectSpec& object, double force_n, std::uint64_t seed = 1) {
  auto imprint = press_winkler(placed(object, seed), bed_under(object), force_n);
  REQUIRE(imprint.has_value());
  return std::move(*imprint);
}

double deviation(const std::vector<double>& values) {
  double sum = 0, squares = 0;
  for (const double v : values) sum += v, squares += v * v;
  const auto n = static_cast<double>(values.size());
  return std::sqrt(squares / n - sum * sum / n / n);
}

Imprint uniform(double pressure_pa) {
  return {1, 4, std::vector<double>(4, pressure_pa), 0, 1};
}

constexpr TaxelParams quiet{.noise_counts = 0};

int count_of(double pressure_pa, CoverState& cover, const TaxelParams& params = quiet) {
  const auto frame = read_taxels(params, uniform(pressure_pa), cover, 1);
  REQUIRE(frame.has_value());
  return frame->counts[0];
}

}  // namespace

TEST_CASE("There are three objects of each class, twenty-four imprints with two forces") {
  std::array<int, 4> of_class{};
  std::set<std::string_view> names;
  for (const ObjectSpec& object : ellis_objects()) {
    ++of_class.at(static_cast<std::size_t>(object.object_class));
    names.insert(object.name);
    CHECK(object.name.substr(0, 2) == (object.object_class == ObjectClass::planar   ? "PL"
                                       : object.object_class == ObjectClass::rasp   ? "RA"
                                       : object.object_class == ObjectClass::screen ? "SC"
                                                                                    : "KN"));
    for (const double force : {light_press_n, heavy_press_n}) {
      const Imprint imprint = pressed(object, force);
      const double cell = taxel_spacing_m * taxel_spacing_m;
      CHECK(total_force_n(imprint, cell) == Approx(force).epsilon(1e-11));
      CHECK(imprint.contact_fraction > 0.01);
    }
  }
  CHECK(of_class == std::array{3, 3, 3, 3});
  CHECK(names.size() == 12);
  CHECK(to_string(ObjectClass::knit) == "knit");
  CHECK(find_object("RASP4") == nullptr);
}

TEST_CASE("Screens have the open area and rasps the teeth of their lattices") {
  const auto share_below = [](const HeightMap& map, double depth_m) {
    const double top = highest_m(map);
    return static_cast<double>(std::count_if(map.height_m.begin(), map.height_m.end(),
                                             [&](double h) { return h < top - depth_m; })) /
           static_cast<double>(map.height_m.size());
  };
  for (const char* name : {"SCREEN1", "SCREEN2", "SCREEN3"}) {
    const ObjectSpec screen = object_of(name);
    const double open =
        3.14159265 * screen.radius_m * screen.radius_m / (screen.pitch_x_m * screen.pitch_y_m);
    double mean = 0;
    for (std::uint64_t seed = 0; seed < 8; ++seed)
      mean += share_below(placed(screen, seed), screen.depth_m / 2) / 8;
    CHECK(mean == Approx(open).epsilon(0.05));
  }
  for (const char* name : {"RASP1", "RASP3"}) {
    ObjectSpec rasp = object_of(name);
    rasp.irregularity = rasp.roughness_m = 0;
    const double top = rasp.depth_m / 2;  // a cone except for its tip: half as wide half-way down
    const double half = (rasp.radius_m / 2 + 0.2e-3), wide = std::sqrt(half * half - 0.04e-6);
    const double share = 3.14159265 * wide * wide / (rasp.pitch_x_m * rasp.pitch_y_m);
    double mean = 0;
    for (std::uint64_t seed = 0; seed < 8; ++seed) {
      const HeightMap map = placed(rasp, seed);
      const auto above = std::count_if(map.height_m.begin(), map.height_m.end(),
                                       [&](double h) { return h > -top; });
      mean += static_cast<double>(above) / static_cast<double>(map.height_m.size()) / 8;
    }
    CHECK(mean == Approx(share).epsilon(0.05));
  }
}

TEST_CASE("A wool cuff under the heavy press is nearly a plane, under the light one it is not") {
  const ObjectSpec cuff = object_of("KNIT1");
  const auto relief = [](const Imprint& imprint) {
    double mean = 0;
    for (const double p : imprint.pressure_pa) mean += p / 16384;
    return deviation(imprint.pressure_pa) / mean;
  };
  const Imprint light = pressed(cuff, light_press_n), heavy = pressed(cuff, heavy_press_n);
  CHECK(light.contact_fraction < 0.9);
  CHECK(heavy.contact_fraction > 0.99);
  CHECK(relief(heavy) < 0.6 * relief(light));
}

TEST_CASE("The same seed is the same imprint; another seed lays the same object elsewhere") {
  for (const ObjectSpec& object : ellis_objects()) {
    CAPTURE(object.name);
    const HeightMap one = placed(object, 5, 32);
    CHECK(one.height_m == placed(object, 5, 32).height_m);
    CHECK_FALSE(one.height_m == placed(object, 6, 32).height_m);
  }
}

TEST_CASE("A rigid object leaves the cover as it is; a soft one lies behind it in series") {
  const ObjectSpec rigid = object_of("PLANE2"), soft = object_of("KNIT2");
  CHECK(spring_pressure_pa(bed_under(rigid, 2e8), 1e-4) == Approx(2e4).epsilon(1e-14));
  CHECK(1e-4 / spring_pressure_pa(bed_under(soft, 2e8), 1e-4) ==
        Approx(1 / 2e8 + soft.compliance_m_pa).epsilon(1e-12));
  CHECK(modulus_under(rigid, 3e6) == 3e6);
  CHECK(1 / modulus_under(soft, 3e6) == Approx(1 / 3e6 + 1 / soft.modulus_pa).epsilon(1e-14));
}

TEST_CASE("Objects that cannot be are refused with a sentence") {
  for (const double bad : {not_a_number, inf, -1.0, 1e308, 2.0}) {
    for (double ObjectSpec::*field :
         {&ObjectSpec::pitch_x_m, &ObjectSpec::pitch_y_m, &ObjectSpec::radius_m,
          &ObjectSpec::depth_m, &ObjectSpec::irregularity, &ObjectSpec::roughness_m,
          &ObjectSpec::bow_m, &ObjectSpec::compliance_m_pa}) {
      ObjectSpec object = object_of("RASP1");
      object.*field = bad;
      CHECK_FALSE(place(object, 8, 8, taxel_spacing_m, 1).has_value());
    }
  }
  ObjectSpec object = object_of("RASP1");
  object.pitch_x_m = 0;
  const auto refused = place(object, 8, 8, taxel_spacing_m, 1);
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == Errc::range);
  CHECK(refused.error().where == "RASP1: pitch_x_m");
  CHECK(refused.error().expected == "0 to 1");
  CHECK(refused.error().got == "0.000000");
  CHECK_FALSE(place(object_of("KNIT1"), 0, 8, taxel_spacing_m, 1).has_value());
}

TEST_CASE("Counts are linear in the pressure up to the ceiling of seven bits") {
  for (int count = 0; count <= 127; count += 9) {
    CoverState fresh;
    CHECK(count_of(quiet.full_scale_pa * count / 127, fresh) == count);
  }
  CoverState fresh;
  CHECK(count_of(1e29, fresh) == 127);
  const auto all = read_taxels(quiet, uniform(1e9), fresh, 1);
  CHECK(all->saturated_fraction == 1);
  const auto none = read_taxels(quiet, uniform(0), fresh, 1);
  CHECK(none->saturated_fraction == 0);
  CHECK(none->counts[3] == 0);
}

TEST_CASE("A press that is taken back reads high by the hysteresis, by any path, and never low") {
  const double half = quiet.full_scale_pa / 2;
  const auto after = [&](std::initializer_list<double> path) {
    CoverState cover;
    int count = 0;
    for (const double pressure : path) count = count_of(pressure, cover);
    return count;
  };
  CHECK(after({half}) == 64);
  CHECK(after({1.1 * half, half}) == 70);                        // the whole overshoot remains
  CHECK(after({1.9 * half, half}) == std::lround(63.5 * 1.25));  // limited by the hysteresis
  CHECK(after({1.9 * half, 1.5 * half, 1.2 * half, half}) == after({1.9 * half, half}));
  CHECK(after({1.9 * half, 0.9 * half, half}) == after({1.125 * half, half}));
  CHECK(after({1.9 * half, 0}) == 0);
  CHECK(after({0.2 * half, half}) == 64);
}

TEST_CASE("Noise has the rms that is asked for, is seeded, and can be switched off") {
  Imprint imprint{64, 64, std::vector<double>(4096, 75e3), 0, 1};
  CoverState cover;
  TaxelParams params;
  params.noise_counts = 3;
  const auto frame = read_taxels(params, imprint, cover, 9);
  REQUIRE(frame.has_value());
  std::vector<double> counts(frame->counts.begin(), frame->counts.end());
  CHECK(deviation(counts) == Approx(std::sqrt(9 + 1.0 / 12)).epsilon(0.05));
  CHECK(frame->counts == read_taxels(params, imprint, cover, 9)->counts);
  CHECK(frame->counts != read_taxels(params, imprint, cover, 10)->counts);
}

TEST_CASE("Taxel parameters and pressures that cannot be are refused") {
  CoverState cover;
  for (const double bad : {not_a_number, inf, -inf, -1.0, 1e308}) {
    CHECK_FALSE(read_taxels({.full_scale_pa = bad}, uniform(1), cover, 1).has_value());
    CHECK_FALSE(read_taxels({.hysteresis = bad}, uniform(1), cover, 1).has_value());
    CHECK_FALSE(read_taxels({.noise_counts = bad}, uniform(1), cover, 1).has_value());
    CHECK_FALSE(read_taxels(quiet, uniform(bad), cover, 1).has_value());
    CoverState spoilt{std::vector<double>(4, bad)};
    CHECK_FALSE(read_taxels(quiet, uniform(1), spoilt, 1).has_value());
  }
  CHECK_FALSE(read_taxels({.bits = 0}, uniform(1), cover, 1).has_value());
  CHECK_FALSE(read_taxels({.bits = 16}, uniform(1), cover, 1).has_value());
  CoverState other{{1, 2}};
  CHECK_FALSE(read_taxels(quiet, uniform(1), other, 1).has_value());
  CHECK(count_of(1e-310, cover) == 0);
}

}  // namespace imprint_objects_test
