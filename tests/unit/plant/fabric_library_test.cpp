#include "sim/plant/fabric.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "sim/plant/plant.hpp"
#include "tests/unit/plant/support.hpp"

namespace fabric_library_test {

using namespace weft;
using namespace weft::sim;

namespace {

/// The shipped table with one text replaced.
Result<FabricLibrary> with(const std::string& from, const std::string& to) {
  std::string text = test::fabrics_text();
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  return parse_fabrics(text.replace(at, from.size(), to));
}

/// Approximate mean and standard deviation of the pads' pressures over a slide of 20 mm at 5 N.
std::pair<double, double> slide(const Patch& patch) {
  PlantParams params;
  params.geometry.plate_z_m = 0.06;
  Plant plant(params, 1);
  const double touch = 0.06 - patch.material.thickness_m;
  plant.mount(patch, {.z_m = touch - 2e-3});
  for (int i = 0; i <= 100; ++i) plant.advance({.z_m = touch - 2e-3 + 25e-6 * i + 0.2e-3}, 0.01);
  double z = plant.contact().pose.z_m;
  double sum = 0, squares = 0;
  int count = 0;
  for (int i = 0; i < 3000; ++i) {
    z += 1e-6 * std::clamp((5 - plant.contact().normal_n) * 20, -20.0, 20.0);
    plant.advance({.y_m = i < 1000 ? 0 : 1e-5 * (i - 1000), .z_m = z}, 0.01);
    if (i < 1000) continue;
    plant.convert(i % 8, static_cast<std::uint64_t>(i / 8));
    const double pressure = plant.pad_pressures_pa()[static_cast<std::size_t>(i % 8)];
    sum += pressure;
    squares += pressure * pressure;
    ++count;
  }
  const double mean = sum / count;
  return {mean, std::sqrt(squares / count - mean * mean)};
}

}  // namespace

TEST_CASE("the shipped table has the seventeen fabrics and calibrated ones, each once") {
  const FabricLibrary table = test::shipped_library();
  const auto names = table.names();
  CHECK(std::set<std::string>(names.begin(), names.end()).size() == names.size());
  CHECK(test::library().names().size() == 17);
  for (const char* name : {"knitwear1", "wool", "pile", "terry"})
    CHECK(table.find(name) != nullptr);
  CHECK(table.find("leather") == nullptr);
}

TEST_CASE("a table with a fault is refused, with the place of the fault") {
  const auto where = [](const Result<FabricLibrary>& result) {
    REQUIRE_FALSE(result.has_value());
    return result.error().where;
  };
  CHECK(where(with("[0.29, \"sourced\", \"S4\"]", "0.29")) == "/fabrics/5/LC");
  CHECK(where(with("[0.29, \"sourced\", \"S4\"]", "[0.29, \"sourced\", \"S99\"]")) ==
        "/fabrics/5/LC");
  CHECK(where(with("[0.29, \"sourced\", \"S4\"]", "[1e308, \"estimated\"]")) == "/fabrics/5/LC");
  CHECK(where(with("[0.29, \"sourced\", \"S4\"]", "[null, \"estimated\"]")) == "/fabrics/5/LC");
  CHECK(where(with("\"name\": \"wool\"", "\"name\": \"knitwear1\"")) == "/fabrics/1/name");
  CHECK(where(with("\"structure\": \"satin\"", "\"structure\": \"sateen\"")) ==
        "/fabrics/13/structure");
  CHECK(where(with("\"MIU\"", "\"MUI\"")) == "/fabrics/0/MIU");
  CHECK(where(with("\"isotropic_share\": 0.12", "\"isotropic_share\": 0.5")) ==
        "/structures/plain");
  CHECK(where(with("\"waviness_um\"", "\"wavyness_um\"")) == "/parameters/wavyness_um");
  CHECK_FALSE(parse_fabrics("").has_value());
  CHECK_FALSE(parse_fabrics("[]").has_value());
  CHECK(parse_fabrics(R"({"fabrics": {"a": {}, "a": {}}})").error().where == "fabrics: /fabrics/a");
  CHECK_FALSE(parse_fabrics(test::fabrics_text().substr(0, 5000)).has_value());
}

TEST_CASE("the same patch is the same, another is another") {
  const FabricLibrary table = test::library();
  const Patch one = test::patch_of(table, "cotton", 1), same = test::patch_of(table, "cotton", 1);
  const Patch other = test::patch_of(table, "cotton", 2);
  CHECK(test::height_at_m(one.field, 1e-3, 2e-3) == test::height_at_m(same.field, 1e-3, 2e-3));
  CHECK(test::height_at_m(one.field, 1e-3, 2e-3) != test::height_at_m(other.field, 1e-3, 2e-3));
  CHECK(one.material.law.lambda_m != other.material.law.lambda_m);
  CHECK(one.seed != other.seed);
}

TEST_CASE("the height of every patch has twice the roughness as its standard deviation") {
  const FabricLibrary table = test::library();
  for (const Fabric& fabric : table.fabrics) {
    CAPTURE(fabric.name);
    double squares = 0;
    int count = 0;
    for (std::uint64_t seed = 0; seed < 8; ++seed) {
      const Patch patch = test::patch_of(table, fabric.name, seed);
      for (int i = 0; i < 300; ++i, ++count) {
        const double h = test::height_at_m(patch.field, 0.431e-3 * (i % 20), 0.877e-3 * (i / 20));
        squares += h * h;
      }
    }
    CHECK(std::sqrt(squares / count) == Approx(2 * fabric.roughness_m).epsilon(0.25));
  }
}

TEST_CASE("two patches of one fabric agree in their statistics, two fabrics do not") {
  const FabricLibrary table = test::library();
  MaterialSwitches same_trial;
  same_trial.trial_spread = false;
  same_trial.waviness = false;
  const auto one = slide(test::patch_of(table, "corduroy", 1, same_trial));
  const auto two = slide(test::patch_of(table, "corduroy", 2, same_trial));
  const auto felt = slide(test::patch_of(table, "felt", 1, same_trial));
  CHECK(one.first == Approx(two.first).epsilon(0.05));
  CHECK(one.second == Approx(two.second).epsilon(0.4));
  CHECK(felt.second < 0.6 * one.second);
}

TEST_CASE("each level is drawn from its own seed alone, each of its members from its own stream") {
  const FabricLibrary table = test::library();
  const auto cut = [&](const PatchSeeds& seeds, const Spread& spread) {
    auto patch = cut_patch(*table.find("denim"), table.params, spread, {}, seeds);
    WEFT_ASSERT(patch.has_value());
    return *patch;
  };
  const Patch base = cut({1, 2, 3}, table.spread);
  const Patch piece = cut({9, 2, 3}, table.spread), mounting = cut({1, 9, 3}, table.spread),
              touch = cut({1, 2, 9}, table.spread);
  const auto phase = [](const Patch& patch) { return patch.field.terms().back().phase_rad; };
  CHECK(phase(piece) != phase(base));
  CHECK(phase(mounting) == phase(base));
  CHECK(phase(touch) == phase(base));
  CHECK(piece.material.thickness_m != base.material.thickness_m);
  CHECK(mounting.material.thickness_m == base.material.thickness_m);
  CHECK(piece.skew_rad == base.skew_rad);
  CHECK(mounting.skew_rad != base.skew_rad);
  CHECK(touch.skew_rad == base.skew_rad);
  CHECK(touch.pad_ratio != base.pad_ratio);
  CHECK(mounting.pad_ratio == base.pad_ratio);
  CHECK(piece.pad_ratio == base.pad_ratio);
  CHECK(touch.mounted == base.mounted);
  CHECK(mounting.mounted != base.mounted);
  CHECK(piece.mounted != base.mounted);
  Spread without = table.spread;
  without.piece = {0, 0, 0, 0, 0, 0};
  without.touch = {0, 0, 0};
  const Patch alone = cut({1, 2, 3}, without);
  CHECK(alone.skew_rad == base.skew_rad);
  CHECK(alone.tilt_x == base.tilt_x);
  Spread untouched = table.spread;
  untouched.mounting.position_m = untouched.touch.path_m = 0;
  const Patch still = cut({1, 2, 3}, untouched);
  CHECK(still.offset_x_m == 0);
  CHECK(still.tilt_x == base.tilt_x);
  CHECK(still.pad_ratio == base.pad_ratio);
  CHECK(still.material.law.lambda_m == base.material.law.lambda_m);
}

TEST_CASE("a table from before there were levels gives them what it has") {
  nlohmann::json old = nlohmann::json::parse(test::fabrics_text());
  old.erase("spread");
  old["trial_spread"] = {{"lambda", {0.2, "estimated"}},
                         {"gain", {0.1, "estimated"}},
                         {"tilt_mrad", {3, "estimated"}}};
  const auto read = parse_fabrics(old.dump());
  REQUIRE(read);
  CHECK(read->spread.piece.lambda == 0.2);
  CHECK(read->spread.touch.gain == 0.1);
  CHECK(read->spread.mounting.tilt == Approx(3e-3));
}

TEST_CASE("a surface that is shifted is the same surface further on") {
  const FabricLibrary table = test::library();
  const Patch patch = test::patch_of(table, "corduroy", 3);
  const HeightField there = patch.field.shifted(2e-3, -1e-3);
  const Waviness waves = patch.material.waviness.shifted(2e-3, -1e-3);
  for (int i = 0; i < 20; ++i) {
    const double x = 1.3e-3 * i, y = 0.7e-3 * i;
    CHECK(test::height_at_m(there, x, y) ==
          Approx(test::height_at_m(patch.field, x + 2e-3, y - 1e-3)).margin(1e-12));
    CHECK(waves.height_m(x, y) ==
          Approx(patch.material.waviness.height_m(x + 2e-3, y - 1e-3)).margin(1e-12));
  }
}

TEST_CASE("material and spread that cannot be are refused with the cloth's name") {
  const FabricLibrary table = test::library();
  CHECK(check(table.params));
  CHECK(check(table.spread));
  const auto refused = [&](const MaterialParams& params, const Spread& spread) {
    const auto patch = cut_patch(table.fabrics.front(), params, spread, {}, 1);
    return patch ? std::string() : patch.error().where + ": " + patch.error().what;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  MaterialParams timeless = table.params;
  timeless.relaxation_time_s[1] = 0;
  CHECK_THAT(refused(timeless, table.spread), Catch::Contains("second relaxation time") &&
                                                  Catch::Contains(table.fabrics.front().name));
  MaterialParams reversed = table.params;
  reversed.waviness.longest_wave_m = reversed.waviness.shortest_wave_m / 2;
  CHECK_THAT(refused(reversed, table.spread), Catch::Contains("longest wave"));
  Spread wild = table.spread;
  wild.mounting.tilt = nan;
  CHECK_THAT(refused(table.params, wild), Catch::Contains("tilt"));
}

}  // namespace fabric_library_test
