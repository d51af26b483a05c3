// A trial with accelerometer and microphone: the record equals the plant's output.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/storage/dataset/hdf5_file.hpp"
#include "sim/devices/bench_plant.hpp"
#include "sim/rig/rig_config.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace vibro_trial_test {

using namespace weft;
using namespace weft::daemon;
using nlohmann::json;

namespace {

json vibro_rig() {
  json rig = json::parse(test::read_file(test::source / "sim/rigs/vibro17.json"));
  rig["simulation"]["fabrics"] = (test::source / "sim/fabrics.json").string();
  return rig;
}

std::string one_slide() {
  json recipe = json::parse(test::short_recipe("corduroy"));
  recipe["explorations"].erase("M2");
  return recipe.dump();
}

/// The plant alone, moved again along the stages' path with the trial's patch.
sim::VibrationReadings sounds_along(const sim::BenchMotion& motion, const std::string& rig_json) {
  const auto config = sim::parse_rig_config(rig_json).value();
  sim::Plant plant(config.bench_plant.plant, 1);
  plant.mount(motion.patch, motion.mounted, motion.mounted_at);
  TimePoint now = motion.mounted_at;
  sim::GridPoint next = motion.first;
  for (const sim::Pose& pose : motion.poses) {
    plant.advance(pose, to_seconds(next.time() - now));
    now = next.time();
    next.advance();
  }
  return plant.extract_vibration();
}

double rms_in(const TrialRecord& record, const classifier::Trial& trial, Phase phase) {
  std::int64_t first = 0, last = 0;
  for (std::size_t i = 0; i < trial.samples(); ++i) {
    if (trial.phase[i] != phase) continue;
    if (first == 0) first = record.t_ns[i];
    last = record.t_ns[i];
  }
  const std::size_t size = record.sound.quanta.size() / record.sound.blocks();
  double squares = 0;
  std::size_t count = 0;
  for (std::size_t b = 0; b < record.sound.blocks(); ++b) {
    if (record.sound.t_ns[b] < first + 50'000'000 || record.sound.t_ns[b] > last) continue;
    for (std::size_t k = 0; k < size; ++k) {
      const double pa = record.sound.quanta[b * size + k] / sound_quanta_per_pa;
      squares += pa * pa;
      ++count;
    }
  }
  REQUIRE(count > 1000);
  return std::sqrt(squares / static_cast<double>(count));
}

}  // namespace

TEST_CASE("a slide's acceleration and sound come back from the file reading for reading") {
  const json rig = vibro_rig();
  test::TrialBench bench(one_slide(), rig);
  bench.sim.rig->record_motion(true);
  Supervisor supervisor(bench.checked.plan, bench.sim.host_time, *bench.sim.bench, *bench.recording,
                        bench.hooks());
  supervisor.start();
  bench.sim.loop.run_until([&] { return supervisor.result().has_value(); });
  INFO((bench.trial_error ? to_string(*bench.trial_error) : std::string("no error")));
  REQUIRE(bench.outcomes == std::vector{recipes::Outcome::complete});
  const auto motion = bench.sim.rig->extract_motion(bench.sim.loop.now());
  REQUIRE(motion);
  const sim::VibrationReadings received = sounds_along(*motion, rig.dump());
  REQUIRE(bench.recorder->finish());
  const Dataset data = load_campaign(bench.folder / "c.sqlite").value();
  REQUIRE(data.records.size() == 1);
  const TrialRecord& record = data.records[0];

  CHECK(data.info.sound == BlockFormat{8000, 160});
  CHECK(data.info.acceleration == BlockFormat{200, 4});
  REQUIRE(record.sound.blocks() > 300);
  const std::uint64_t first_sound = received.sound.front().index;
  for (std::size_t i = 0; i < record.sound.quanta.size(); ++i) {
    const std::uint64_t index = record.sound.device_us[i / 160] / 125 + i % 160;
    const sim::SoundReading& made = received.sound.at(index - first_sound);
    REQUIRE(made.index == index);
    REQUIRE(record.sound.quanta[i] == std::lround(made.pressure_pa * 1e6));
  }
  const std::uint64_t first_shake = received.acceleration.front().index;
  for (std::size_t i = 0; i < record.acceleration.quanta.size(); ++i) {
    const std::uint64_t index = record.acceleration.device_us[i / 12] / 5000 + i / 3 % 4;
    const sim::AccelerationReading& made = received.acceleration.at(index - first_shake);
    REQUIRE(made.index == index);
    REQUIRE(record.acceleration.quanta[i] == std::lround(made.acceleration_mps2[i % 3] * 1e6));
  }
  for (const BlockStream* stream : {&record.sound, &record.acceleration}) {
    CHECK(std::ranges::all_of(stream->lost, [](std::uint32_t lost) { return lost == 0; }));
    for (std::size_t b = 1; b < stream->blocks(); ++b) {
      // between two phases nothing is recorded
      const std::uint32_t apart_us = stream->device_us[b] - stream->device_us[b - 1];
      REQUIRE(apart_us % 20'000 == 0);
    }
  }
  CHECK(rms_in(record, data.trials[0], Phase::motion) >
        1.5 * rms_in(record, data.trials[0], Phase::rest));
}

TEST_CASE("a campaign with vibrations is run, exported and read back with one digest") {
  const test::TemporaryFolder folder;
  auto request = test::request_in(folder, one_slide(), vibro_rig());
  request.error_check = false;
  const auto summary = run_campaign(request, {});
  if (!summary) FAIL(to_string(summary.error()));
  REQUIRE(summary->outcome == recipes::Outcome::complete);
  CHECK(summary->level == "L3");
  const Dataset exported = read_hdf5(summary->dataset_file).value();
  const Dataset recorded = load_campaign(summary->campaign_file).value();
  CHECK(test::same_content(exported, recorded));
  CHECK(dataset_sha256(recorded) == summary->dataset_sha256);
  CHECK(exported.records[0].sound.blocks() > 300);
  REQUIRE(exported.info.devices.size() == 8);
  CHECK(exported.info.devices[7].identity_json.find("pa_per_count") != std::string::npos);
}

TEST_CASE("a rig may do without vibrations, and has one sensor of them at most") {
  json rig = vibro_rig();
  REQUIRE(parse_rig_file(rig.dump()));
  rig["devices"].push_back(rig["devices"][7]);
  CHECK(parse_rig_file(rig.dump()).error().where == "/devices");
  CHECK(parse_rig_file(rig.dump()).error().got == "2 devices");
  const auto limits = recipes::parse_rig_limits(vibro_rig().dump()).value();
  CHECK(limits.acceleration_rate_hz == 200);
  CHECK(limits.sound_rate_hz == 8000);
  CHECK(recipes::parse_rig_limits(test::bench17().dump()).value().sound_rate_hz == 0);
}

TEST_CASE("a device in a role that its samples do not fill is a fault that names it") {
  json rig = vibro_rig();
  json& taxels = test::device_of(rig, "taxels");
  json& vibro = test::device_of(rig, "vibro");
  std::swap(taxels["role"], vibro["role"]);
  const test::TemporaryFolder folder;
  const auto run = run_campaign(test::request_in(folder, one_slide(), rig), {});
  REQUIRE_FALSE(run);
  const std::string reply = to_string(run.error());
  INFO(reply);
  CHECK(reply.find("samples of driver") != std::string::npos);
  CHECK((reply.find(taxels["name"]) == 0 || reply.find(vibro["name"]) == 0));
}

TEST_CASE(
    "a driver that expects another rate than the sensor's is refused before the first trial") {
  json rig = vibro_rig();
  test::device_of(rig, "vibro")["config"]["sound_rate_hz"] = 16000;
  const test::TemporaryFolder folder;
  const auto run = run_campaign(test::request_in(folder, one_slide(), rig), {});
  REQUIRE_FALSE(run);
  CHECK(to_string(run.error()).find("sound") != std::string::npos);
  CHECK(to_string(run.error()).find("16000") != std::string::npos);
}

}  // namespace vibro_trial_test
