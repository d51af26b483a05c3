// The sensor's cover, common and individual effects of its pads, and the wear of a fabric, each
// against its closed form.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <vector>

#include "sim/plant/plant.hpp"
#include "sim/plant/texture_map.hpp"
#include "tests/unit/plant/support.hpp"

namespace sensor_and_wear_test {

using namespace weft::sim;

namespace {

struct Moments {
  double mean, deviation;
};

Moments moments(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / n;
  double squares = 0;
  for (const double value : values) squares += (value - mean) * (value - mean);
  return {mean, std::sqrt(squares / n)};
}

/// A sensor without random effects, hysteresis and creep.
PadParams quiet() {
  PadParams params;
  params.gain_spread = params.gap_spread = params.crosstalk = params.creep = 0;
  params.hysteresis = params.drift_counts = params.noise_counts = 0;
  params.baseline_low_counts = params.baseline_high_counts = 5000;
  return params;
}

/// Readings of pad 0 and pad 5 in `frames` scans under one pressure.
std::array<std::vector<double>, 2> scans(const PadParams& params, double pressure_pa,
                                         std::uint64_t frames) {
  PadArray pads(params, 3);
  pads.reset(7, 1);
  std::array<double, pad_count> pressures;
  pressures.fill(pressure_pa);
  std::array<std::vector<double>, 2> out;
  for (std::uint64_t frame = 0; frame < frames; ++frame) {
    pads.convert_stages(pressures, frame);
    out[0].push_back(pads.counts()[0]);
    out[1].push_back(pads.counts()[5]);
  }
  return out;
}

double series_indentation_m(const FabricLaw& cloth, const Cover& cover, double pressure_pa) {
  return cloth.lambda_m * std::log1p(pressure_pa / cloth.pressure_pa) +
         cover.lambda_m * std::log1p(pressure_pa / cover.pressure_pa);
}

/// dp/d(indentation) of fabric and cover in series.
double series_stiffness(const FabricLaw& cloth, const Cover& cover, double pressure_pa) {
  return 1 / (cloth.lambda_m / (pressure_pa + cloth.pressure_pa) +
              cover.lambda_m / (pressure_pa + cover.pressure_pa));
}

}  // namespace

TEST_CASE("a rigid cover leaves a cloth's law as it is, to the bit") {
  const FabricLaw cloth{60e-6, 280, 0.3}, both = compose(cloth, {0, 300});
  CHECK(both.lambda_m == cloth.lambda_m);
  CHECK(both.pressure_pa == cloth.pressure_pa);
}

TEST_CASE("cloth and cover together are two exponential springs in series") {
  const Cover alike{60e-6, 280};
  const FabricLaw exact = compose({90e-6, 280, 0}, alike);
  for (const double pressure_pa : {100.0, 1e3, 7.7e3, 4e4})
    CHECK(exact.lambda_m * std::log1p(pressure_pa / exact.pressure_pa) ==
          Approx(series_indentation_m({90e-6, 280, 0}, alike, pressure_pa)).epsilon(1e-12));
  const FabricLibrary table = test::library();
  for (const double cover_m : {60e-6, 100e-6})
    for (const Fabric& fabric : table.fabrics) {
      const FabricLaw cloth = *law_from_kes(fabric.kes), both = compose(cloth, {cover_m, 300});
      const auto off = [&](double pressure_pa) {
        const double stiffness = (pressure_pa + both.pressure_pa) / both.lambda_m;
        return stiffness / series_stiffness(cloth, {cover_m, 300}, pressure_pa) - 1;
      };
      INFO(fabric.name << " under " << cover_m);
      CHECK(std::abs(off(7.7e3)) < 0.016);
      CHECK(std::abs(off(19.5e3)) < 0.007);
    }
}

TEST_CASE("noise grows with the level according to its law") {
  PadParams params = quiet();
  params.noise_counts = 1;
  params.noise_per_count = 0.02;
  params.noise_per_square = 1e-5;
  for (const double pressure_pa : {0.0, 5e3, 2e4}) {
    const double level = moments(scans(quiet(), pressure_pa, 1)[0]).mean - 5000;
    const double expected =
        std::sqrt(1 + 0.02 * level + 1e-5 * level * level + 1.0 / 12);  // the width of a count
    CHECK(moments(scans(params, pressure_pa, 20'000)[0]).deviation ==
          Approx(expected).epsilon(0.03));
  }
}

TEST_CASE("noise that does not grow has the bits of before") {
  PadParams flat = quiet(), tiny = quiet();
  flat.noise_counts = tiny.noise_counts = 1.5;
  tiny.noise_per_square = 1e-300;  // uses the code for noise that grows
  CHECK(scans(flat, 2e4, 500)[1] == scans(tiny, 2e4, 500)[1]);
}

TEST_CASE("the common mode moves all pads alike, with its deviation and its time") {
  PadParams params = quiet();
  params.common_mode = 0.01;
  params.common_mode_time_s = 0.5;
  const auto [first, other] = scans(params, 2e4, 40'000);
  const double level = moments(scans(quiet(), 2e4, 1)[0]).mean - 5000;
  CHECK(moments(first).deviation == Approx(0.01 * level).epsilon(0.05));
  const Moments a = moments(first), b = moments(other);
  double along = 0, together = 0;
  const std::size_t lag = 18;  // 0.4865 s
  for (std::size_t i = 0; i + lag < first.size(); ++i) {
    along += (first[i] - a.mean) * (first[i + lag] - a.mean);
    together += (first[i] - a.mean) * (other[i] - b.mean);
  }
  const double per = static_cast<double>(first.size() - lag) * a.deviation;
  CHECK(along / (per * a.deviation) == Approx(std::exp(-18 / 37.0 / 0.5)).margin(0.05));
  CHECK(together / (per * b.deviation) > 0.99);
  CHECK(moments(scans(params, 0, 1000)[0]).deviation == 0);  // without pressure
}

TEST_CASE("temperature changes the gain of all pads") {
  PadParams params = quiet();
  params.temperature_k = 5;
  params.temperature_time_s = 0.5;
  params.gain_per_k = 4e-3;
  const double level = moments(scans(quiet(), 2e4, 1)[0]).mean - 5000;
  CHECK(moments(scans(params, 2e4, 40'000)[0]).deviation == Approx(0.02 * level).epsilon(0.05));
}

TEST_CASE("gains of pads are log-normal") {
  PadParams params = quiet();
  params.gain_spread = 0.4;
  std::vector<double> logs;
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    PadArray pads(params, seed);
    pads.reset(1, 1);
    std::array<double, pad_count> pressures;
    pressures.fill(2e4);
    pads.convert_stages(pressures, 0);
    for (const std::uint16_t counts : pads.counts()) logs.push_back(std::log(counts - 5000.0));
  }
  CHECK(moments(logs).deviation == Approx(0.4).epsilon(0.03));
}

TEST_CASE("a pad that reaches further presses harder, by its height over lambda") {
  const FabricLibrary table = test::library();
  Patch patch = test::patch_of(table, "felt", 1, test::plain_cloth);
  PlantParams params;
  params.geometry = test::level_plate();
  Plant level(params, 1);
  level.mount(patch, {});
  patch.pad_height_m[3] = 20e-6;
  Plant uneven(params, 1);
  uneven.mount(patch, {});
  const auto pressures = [&](Plant& plant) {
    plant.advance({.z_m = test::plate_z - patch.material.thickness_m + 0.4e-3}, 1);
    for (int stage = 0; stage < pad_timing::stages; ++stage) plant.convert(stage, 0);
    return plant.pad_pressures_pa();
  };
  const auto without = pressures(level), with = pressures(uneven);
  CHECK(with[2] == without[2]);
  const double p_s = patch.material.law.pressure_pa * level.contact().load_ratio;
  CHECK((with[3] + p_s) / (without[3] + p_s) ==
        Approx(std::exp(20e-6 / patch.material.law.lambda_m)).epsilon(1e-6));
}

namespace {

constexpr double slide_m = 50e-3;

/// Presses and slides; the remaining response of the surface at pad 5, and the dose.
struct Stroke {
  std::vector<double> pressures_pa;
  double mean_n = 0, dose_pa_m = 0;
};

Stroke stroke(Plant& plant, const Patch& patch, const PlantMemory* memory) {
  const double z_m = test::plate_z - patch.material.thickness_m + 0.5e-3;
  plant.mount(patch, {}, {}, memory);
  plant.advance({.z_m = z_m}, 1);
  Stroke out;
  const std::uint64_t frames = 500;
  for (std::uint64_t frame = 0; frame < frames; ++frame) {
    const double y_m = slide_m * static_cast<double>(frame) / static_cast<double>(frames - 1);
    plant.advance({.y_m = y_m, .z_m = z_m}, 0.027);
    for (int stage = 0; stage < pad_timing::stages; ++stage) plant.convert(stage, frame);
    out.pressures_pa.push_back(plant.pad_pressures_pa()[5]);
    out.mean_n += plant.contact().normal_n / static_cast<double>(frames);
  }
  out.dose_pa_m = plant.memory().dose_pa_m;
  return out;
}

Patch worn_patch(double most) {
  FabricLibrary table = test::library();
  table.params.wear.most = most;
  MaterialSwitches switches = test::plain_cloth;
  switches.texture = true;
  return test::patch_of(table, "flax", 4, switches);
}

PlantParams on_level_plate() {
  PlantParams params;
  params.geometry = test::level_plate();
  return params;
}

}  // namespace

TEST_CASE("the dose of a stroke is force over area times its length") {
  const Patch patch = worn_patch(0.05);
  const PlantParams params = on_level_plate();
  Plant plant(params, 1);
  const Stroke first = stroke(plant, patch, nullptr);
  CHECK(first.dose_pa_m ==
        Approx(first.mean_n / params.geometry.face_area_m2() * slide_m).epsilon(0.01));
  const PlantMemory memory = plant.memory();
  CHECK(stroke(plant, patch, &memory).dose_pa_m > 1.9 * first.dose_pa_m);
  CHECK(stroke(plant, patch, nullptr).dose_pa_m < 1.1 * first.dose_pa_m);
}

TEST_CASE("wear flattens the surface, all of it at most, and no wear changes no bit") {
  const PlantParams params = on_level_plate();
  const auto roughness = [&](double most, double dose_pa_m) {
    const Patch patch = worn_patch(most);
    Plant plant(params, 1);
    plant.mount(patch, {});
    PlantMemory memory = plant.memory();
    memory.dose_pa_m = dose_pa_m;
    const Stroke run = stroke(plant, patch, &memory);
    const Moments of = moments(run.pressures_pa);
    return of.deviation / of.mean;
  };
  const double fresh = roughness(0, 0);
  CHECK(roughness(0, 1e9) == fresh);
  CHECK(roughness(1, 1e-9) == Approx(fresh).epsilon(1e-6));
  CHECK(roughness(0.5, 1e9) < 0.7 * fresh);
  CHECK(roughness(1, 1e9) < 0.02 * fresh);
}

TEST_CASE("a hundred thousand touches of one mounting stay finite") {
  const Patch patch = worn_patch(0.05);
  Plant plant(on_level_plate(), 1);
  plant.mount(patch, {});
  PlantMemory memory = plant.memory();
  memory.dose_pa_m = 1e5 * 1e3;
  const Stroke last = stroke(plant, patch, &memory);
  for (const double pressure_pa : last.pressures_pa) REQUIRE(std::isfinite(pressure_pa));
  CHECK(last.mean_n > 0);
}

TEST_CASE("a level that is switched off changes no draw of the others") {
  FabricLibrary table = test::library();
  const Patch with = test::patch_of(table, "denim", 9);
  table.spread.mounting.pad_height_m = 5e-6;
  const Patch more = test::patch_of(table, "denim", 9);
  CHECK(with.tilt_x == more.tilt_x);
  CHECK(with.material.law.lambda_m == more.material.law.lambda_m);
  CHECK(with.pad_ratio == more.pad_ratio);
  CHECK(with.pad_height_m[0] != more.pad_height_m[0]);
}

TEST_CASE("a table may carry the sensor it was calibrated with") {
  const auto document = [](const std::string& standing) {
    auto table = nlohmann::json::parse(test::fabrics_text());
    table["format"] = "weft-fabrics-2";
    if (!table.contains("calibrations")) table["calibrations"] = {{"C1", nlohmann::json::object()}};
    table["sensor"] = {{"gain_spread", nlohmann::json::parse("[0.4, " + standing + "]")}};
    return table.dump();
  };
  const auto read = parse_fabrics(document(R"("calibrated", "C1", [0.3, 0.5])"));
  REQUIRE(read);
  REQUIRE(read->pads);
  CHECK(read->pads->gain_spread == 0.4);
  CHECK(read->pads->noise_counts == PadParams{}.noise_counts);
  CHECK(parse_fabrics(document(R"("not_seen", "C1", [0, 2])")));
  for (const char* wrong : {R"("calibrated", "C99", [0.3, 0.5])", R"("calibrated", "C1")",
                            R"("guessed", "C1", [0.3, 0.5])"})
    CHECK(parse_fabrics(document(wrong)).error().where == "/sensor/gain_spread");
}

TEST_CASE("a table's calibrations are looked at before anything is made of them") {
  const auto refused_at = [](const std::string& pointer, const char* value) {
    auto table = nlohmann::json::parse(test::fabrics_text());
    table["calibrations"]["C1"] = {{"parameters", nlohmann::json::array()}};
    table[nlohmann::json::json_pointer(pointer)] = nlohmann::json::parse(value);
    const auto read = parse_fabrics(table.dump());
    REQUIRE_FALSE(read);
    CHECK(read.error().code == weft::Errc::parse);
    return read.error().where;
  };
  for (const auto& [pointer, value] :
       {std::pair{"/calibrations", "[]"},
        {"/calibrations", "3"},
        {"/calibrations/C9", "3"},
        {"/calibrations/C1/dataset_sha256", R"("e3b0")"},
        {"/calibrations/C1/dataset_sha256", "[3]"},
        {"/calibrations/C1/counts_scale", "0"},
        {"/calibrations/C1/counts_scale", R"("1")"},
        {"/calibrations/C1/parameters", "{}"},
        {"/calibrations/C1/parameters", R"([{"cloth": "", "standing": "bounded", "value": 1}])"},
        {"/calibrations/C1/parameters",
         R"([{"name": "a", "cloth": "", "standing": "bounded", "value": "1"}])"}})
    CHECK(refused_at(pointer, value) == pointer);
}

}  // namespace sensor_and_wear_test
