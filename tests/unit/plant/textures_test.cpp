// The twelve textures of the scene vibrotactile, the 118 of script/textures118, and the effect of
// grains.

#include <catch2/catch.hpp>
#include <cmath>
#include <set>

#include "sim/plant/fabric.hpp"
#include "sim/plant/modal/rubbing.hpp"
#include "sim/plant/plant.hpp"
#include "tests/unit/source_text.hpp"

namespace textures_test {

using namespace weft;
using namespace weft::sim;

namespace {

FabricLibrary textures(const char* file = "sim/textures.json") {
  auto read = parse_fabrics(testing::source_text(file));
  INFO((read ? std::string() : to_string(read.error())));
  REQUIRE(read.has_value());
  return *read;
}

/// Standard deviation of the force on the plate along a smooth slide of 300 mm at 3 N.
double scratching_n(const RubbingParams& params, std::uint64_t seed) {
  auto rubbing = Rubbing::make(params, {}, seed);
  REQUIRE(rubbing.has_value());
  double sum = 0, squares = 0;
  int count = 0;
  for (int i = 0; i < 150'000; ++i, ++count) {
    const Force force = rubbing->advance({{0, i * 2e-6}, {0, 1}, 3, 1e5});
    sum += force[2];
    squares += force[2] * force[2];
  }
  const double mean = sum / count;
  return std::sqrt(squares / count - mean * mean);
}

}  // namespace

TEST_CASE("the shipped textures are twelve, and a patch can be cut from each") {
  const FabricLibrary table = textures();
  const auto names = table.names();
  CHECK(std::set<std::string>(names.begin(), names.end()).size() == 12);
  CHECK(names.size() == 12);
  for (const Fabric& texture : table.fabrics) {
    CAPTURE(texture.name);
    const auto patch = cut_patch(texture, table.params, table.spread, {}, 7);
    CHECK(patch.has_value());
    if (patch) CHECK(patch->grain_m == texture.grain_m);
  }
  CHECK(table.find("sandpaper_p60")->grain_m == Approx(269e-6));
  CHECK(table.find("felt")->grain_m == 0);
}

TEST_CASE("the 118 textures are distinct, and a patch can be cut from each under any seed") {
  const FabricLibrary table = textures("sim/textures118.json");
  const auto names = table.names();
  CHECK(names.size() == 118);
  std::set<double> thickness, friction;
  for (const Fabric& texture : table.fabrics) {
    CAPTURE(texture.name);
    for (const std::uint64_t seed : {1, 2, 3})
      CHECK(cut_patch(texture, table.params, table.spread, {}, seed).has_value());
    CHECK(texture.thickness_m <= 5e-3);  // below the clear height of 6 mm
    thickness.insert(texture.thickness_m);
    friction.insert(texture.friction_mean);
  }
  CHECK(thickness.size() > 100);
  CHECK(friction.size() > 80);
}

TEST_CASE("grains make the force vary by one over the root of how many bear it") {
  for (const double grain_m : {60e-6, 250e-6, 1e-3}) {
    const RubbingParams params = with_grain({}, grain_m);
    const double borne_by = std::pow(2 * params.face_half_width_m / grain_m, 2);
    double squares = 0;
    constexpr int seeds = 4;
    for (std::uint64_t seed = 0; seed < seeds; ++seed)
      squares += std::pow(scratching_n(params, seed), 2) / seeds;
    CAPTURE(grain_m);
    CHECK(std::sqrt(squares) == Approx(3 / std::sqrt(borne_by)).epsilon(0.15));
  }
}

TEST_CASE(
    "without a grain a surface rubs according to the parameters; no grain makes them absurd") {
  const RubbingParams as_they_are, same = with_grain({}, 0);
  CHECK(same.asperity_share == as_they_are.asperity_share);
  CHECK(same.coarsest_m == as_they_are.coarsest_m);
  RubbingParams point;
  point.face_half_width_m = 0;
  CHECK(Rubbing::make(with_grain(point, 5e-3), {}, 1).has_value());
}

}  // namespace textures_test
