// Scenes without some part: a rig without taxels, and a simulation without noise.

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>

#include "classifier/features/feature_matrix.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "sim/devices/bench_plant.hpp"
#include "sim/rig/rig_config.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace bare_scene_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;
using test::request_in;
using test::short_recipe;
using test::TemporaryFolder;

namespace {

json without_taxels() {
  json rig = test::bench17_near_home();
  json& devices = rig["devices"];
  devices.erase(std::ranges::find(devices, "taxels", [](const json& d) { return d["role"]; }));
  return rig;
}

json without_noise() {
  json rig = test::bench17_near_home();
  rig["simulation"]["pads"]["noise_counts"] = 0;
  rig["simulation"]["pads"]["drift_counts"] = 0;
  test::device_of(rig, "wrench")["emulator"]["noise_scale"] = 0;
  return rig;
}

// Runs it and checks all its files.
Dataset recorded(const json& rig) {
  const TemporaryFolder folder;
  const auto run = run_campaign(request_in(folder, short_recipe("denim"), rig), {});
  if (!run) FAIL(to_string(run.error()));
  INFO((run->error ? to_string(*run->error) : std::string("no error")));
  REQUIRE(run->outcome == recipes::Outcome::complete);
  CHECK(run->trials_complete == 2);
  const auto verified = verify(folder / "out");
  REQUIRE(verified);
  CHECK(verified->certified);
  CHECK(verified->holds());
  auto data = read_hdf5(run->dataset_file);
  if (!data) FAIL(to_string(data.error()));
  CHECK(dataset_sha256(*data) == run->dataset_sha256);
  return std::move(*data);
}

std::string place_refused(const TemporaryFolder& folder, const std::string& recipe) {
  const auto checked = check_request(request_in(folder, recipe, without_taxels()));
  REQUIRE_FALSE(checked);
  CHECK(checked.error().code == Errc::invalid_argument);
  return checked.error().where;
}

bool says_no_noise(const DeviceInfo& device) {
  const json reported = json::parse(device.identity_json).at("reported");
  return reported.contains("noise") && reported["noise"] == "none";
}

}  // namespace

TEST_CASE("a rig without taxels records wrench and phases, and no model is trained from it") {
  const Dataset data = recorded(without_taxels());
  REQUIRE(data.trials.size() == 2);
  const classifier::Trial& trial = data.trials[0];
  CHECK(trial.taxels == 0);
  CHECK(trial.counts.empty());
  CHECK(data.records[0].t_ns == data.records[0].wrench.t_ns);
  // Phase P lasts 2 s at the wrench's 100 Hz.
  CHECK(std::ranges::count(trial.phase, Phase::press) == Approx(200).margin(2));
  CHECK(copies_in(data).empty());
  const auto features = classifier::build_feature_matrix(complete_trials(data, "M1"));
  REQUIRE_FALSE(features);
  CHECK(features.error().code == Errc::invalid_argument);
  CHECK(features.error().what.find("taxels") != std::string::npos);
}

TEST_CASE("what is learnt from taxels is not taken on without them") {
  const TemporaryFolder folder;
  json votes = json::parse(short_recipe("denim"));
  votes["explorations"]["M1"]["live_vote"] = {{"model", "m.weft"}};
  CHECK_THAT(place_refused(folder, votes.dump()), Catch::EndsWith("/explorations/M1/live_vote"));
}

TEST_CASE("taxels that no device reads are not converted") {
  using namespace std::chrono_literals;
  for (const bool reads : {true, false}) {
    INFO("with taxels: " << reads);
    const json rig = reads ? test::bench17_near_home() : without_taxels();
    const auto config = sim::parse_rig_config(rig.dump());
    REQUIRE(config);
    CHECK(config->bench_plant.plant.watched.pads == reads);
    CHECK(config->bench_plant.plant.watched.contact);
    CHECK(config->switches.texture == reads);
    sim::BenchPlant bench(config->bench_plant, 1);
    const auto before = bench.frame(TimePoint(1s)).counts;
    // Every conversion draws noise, so frames of converted pads differ.
    CHECK((bench.frame(TimePoint(2s)).counts != before) == reads);
  }
}

TEST_CASE("a bench without noise runs, records it for its devices and warns once") {
  const Dataset data = recorded(without_noise());
  for (const DeviceInfo& device : data.info.devices)
    CHECK(says_no_noise(device) == (device.name == "ft" || device.name == "taxels"));
  const TemporaryFolder folder;
  const auto warnings = [&](const json& rig) {
    return check_request(request_in(folder, short_recipe("denim"), rig)).value().warnings.size();
  };
  CHECK(warnings(without_noise()) == warnings(test::bench17_near_home()) + 1);
}

TEST_CASE("only an emulator can be without noise") {
  json rig = without_noise();
  CHECK(recipes::lacks_noise(rig, "wrench"));
  CHECK(recipes::lacks_noise(rig, "taxels"));
  CHECK_FALSE(recipes::lacks_noise(rig, "z"));
  const auto limits = recipes::parse_rig_limits(rig.dump());
  REQUIRE(limits);
  CHECK(limits->frozen_wrench_s == 0);
  CHECK(limits->frozen_taxels_s == 0);
  rig["bench"] = "real";
  CHECK_FALSE(recipes::lacks_noise(rig, "wrench"));
  CHECK_FALSE(recipes::lacks_noise(rig, "taxels"));
  CHECK(recipes::parse_rig_limits(rig.dump())->frozen_wrench_s > 0);

  json claims = test::bench17_near_home();  // its pads have noise
  test::device_of(claims, "taxels")["config"]["noise"] = "none";
  const RigFile file = parse_rig_file(claims.dump()).value();
  const auto entry = std::ranges::find(file.devices, "taxels", &DeviceEntry::role);
  CHECK(driver_config(*entry, *file.drivers).error().where == "/noise");
}

}  // namespace bare_scene_test
