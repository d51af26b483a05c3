// The emulated vibration sensor: it sends the plant's readings.

#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>

#include "protocols/vibro/vibro.hpp"
#include "sim/plant/fabric.hpp"
#include "sim/rig/rig_config.hpp"
#include "tests/unit/sim/support.hpp"

namespace vibro_emulator_test {

using namespace weft;
using namespace weft::sim;
namespace vibro = protocols::vibro;
using nlohmann::json;

namespace {

using Changes = std::vector<std::pair<std::string, std::string>>;

/// bench17 with a vibration sensor as its eighth device.
std::string vibro_bench(const std::string& emulator = "{}", const Changes& changes = {}) {
  json rig = json::parse(test::bench17_with(changes));
  json device{{"name", "vibro"}, {"role", "vibro"}, {"driver", "vibro"}};
  device["emulator"] = json::parse(emulator);
  device["emulator"]["kind"] = "vibro";
  rig["devices"].push_back(device);
  return rig.dump();
}

std::string refusal(const std::string& rig) {
  const auto config = parse_rig_config(rig);
  REQUIRE_FALSE(config);
  return to_string(config.error());
}

/// A rig with the sensor switched on at time zero, and the host's end of its link.
struct Bench {
  explicit Bench(const std::string& rig_json) : rig(test::make_rig(rig_json, 9)), link(loop) {
    REQUIRE(rig->attach("vibro", link, loop));
  }
  std::vector<vibro::Frame> frames(vibro::Kind kind) {
    return test::frames_of<vibro::Splitter, vibro::Frame>(link, kind);
  }

  test::TestLoop loop;
  std::unique_ptr<Rig> rig;
  test::TestLink link;
};

/// Counts of all frames, joined.
std::vector<std::int16_t> counts_of(const std::vector<vibro::Frame>& frames) {
  std::vector<std::int16_t> all;
  for (const vibro::Frame& f : frames) all.insert(all.end(), f.counts().begin(), f.counts().end());
  return all;
}

}  // namespace

TEST_CASE("a vibration sensor makes the scene vibrotactile, which level L3 alone gives") {
  const auto config = parse_rig_config(vibro_bench());
  REQUIRE(config);
  CHECK(config->scene.name == "vibrotactile");
  CHECK(config->bench_plant.plant.level == Level::modal);
  CHECK(config->bench_plant.plant.vibration.accelerometer.has_value());
  CHECK(config->bench_plant.plant.vibration.microphone.has_value());
  const std::string by_hand = refusal(vibro_bench("{}", {{"/simulation/level", "\"L2\""}}));
  CHECK(by_hand.starts_with("/simulation/level: "));
  CHECK(by_hand.find("acceleration") != std::string::npos);
  CHECK(by_hand.find("L3 or above") != std::string::npos);
  const auto deaf = parse_rig_config(vibro_bench(R"({"sound_rate_hz": 0})"));
  REQUIRE(deaf);
  CHECK_FALSE(deaf->bench_plant.plant.vibration.microphone.has_value());
}

TEST_CASE("an emulated vibration sensor that cannot be is refused at its key") {
  const auto at = [](const std::string& emulator) { return refusal(vibro_bench(emulator)); };
  CHECK(at(R"({"sound_rate_hz": 7000})").find("/devices/7/emulator/sound_rate_hz") == 0);
  CHECK(at(R"({"sound_rate_hz": 7000})").find("16000 Hz") != std::string::npos);
  CHECK(at(R"({"acceleration_rate_hz": 0.5})").find("acceleration_rate_hz") != std::string::npos);
  CHECK(at(R"({"acceleration_rate_hz": 0, "sound_rate_hz": 0})").find("for both") !=
        std::string::npos);
  CHECK(at(R"({"acceleration_block": 513})").find("at most 512") != std::string::npos);
  CHECK(at(R"({"sound_block": 0})").find("sound_block") != std::string::npos);
  CHECK(at(R"({"form": "cpm_udp"})").find("stream or datagram") != std::string::npos);
  CHECK(at(R"({"gain": 2})").find("gain") != std::string::npos);
  json two = json::parse(vibro_bench());
  two["devices"].push_back(two["devices"][7]);
  two["devices"][8]["name"] = "another";
  CHECK(refusal(two.dump()).starts_with("/devices/8: "));
  CHECK(refusal(two.dump()).find(": two (") != std::string::npos);
}

TEST_CASE("blocks are the plant's own readings, without a gap when the cloth is changed") {
  const std::string rig_json = vibro_bench("{}", {{"/devices/2/emulator/start_mm", "62"}});
  Bench bench(rig_json);
  const TimePoint mounted{Duration(1'234'567'891)}, end{Duration(3'000'000'000)};
  bench.loop.run_to(mounted);
  REQUIRE(bench.rig->mount("denim", 4, mounted));
  bench.loop.run_to(end);

  // the same plant, moved by hand
  const auto library = parse_fabrics(test::fabrics_text()).value();
  const auto config =
      parse_rig_config(rig_json, {library.params.cover, library.pads.value_or(PadParams{})})
          .value();
  BenchPlant bench_plant(config.bench_plant, 9);
  const auto patch =
      cut_patch(*library.find("denim"), library.params, library.spread, config.switches, 4);
  bench_plant.mount(*patch, mounted);
  const VibrationReadings read = bench_plant.extract_vibration(end);

  for (std::size_t i = 0; i < read.sound.size(); ++i) REQUIRE(read.sound[i].index == i + 1);
  for (std::size_t i = 0; i < read.acceleration.size(); ++i)
    REQUIRE(read.acceleration[i].index == i + 1);

  const auto sound = bench.frames(vibro::Kind::sound);
  const std::vector<std::int16_t> pressures = counts_of(sound);
  const std::size_t first_sound = 160;  // number of the first reading of the first block
  REQUIRE(sound.size() == 148);
  double loudest_pa = 0;
  for (std::size_t i = 0; i < pressures.size(); ++i) {
    const double pa = read.sound[first_sound + i - 1].pressure_pa;
    REQUIRE(pressures[i] * (2.0 / 32768) == std::min(pa, 32767 * (2.0 / 32768)));
    loudest_pa = std::max(loudest_pa, std::abs(pa));
  }
  CHECK(loudest_pa > 0.05);  // the noise of a fabric that is loaded suddenly

  const auto shaken = bench.frames(vibro::Kind::acceleration);
  const std::vector<std::int16_t> accelerations = counts_of(shaken);
  REQUIRE(shaken.size() == 149);
  for (std::size_t i = 0; i < accelerations.size(); ++i)
    REQUIRE(accelerations[i] * (19.6133 / 2048) ==
            read.acceleration[4 + i / 3 - 1].acceleration_mps2[i % 3]);

  for (const auto& frames : {sound, shaken})
    for (std::size_t i = 0; i < frames.size(); ++i) {
      REQUIRE(frames[i].sequence == i);
      REQUIRE(frames[i].device_us == 20'000 * (i + 1));
    }
}

TEST_CASE(
    "the sensor sends its description at power-on and each second, and restarts with a new one") {
  Bench bench(vibro_bench(R"({"serial": 42, "acceleration_rate_hz": 1600, "acceleration_block": 16,
                              "sound_rate_hz": 0})"));
  bench.loop.run_for(2.5);
  const auto reported = bench.frames(vibro::Kind::description);
  REQUIRE(reported.size() == 3);
  CHECK(reported[2].device_us == 2'000'000);
  CHECK(reported[0].description ==
        vibro::Description{42, {1, 2, 3}, {1'600'000, 19'613'300, 2048, 16}, {}});
  CHECK(bench.frames(vibro::Kind::sound).empty());
  CHECK(bench.frames(vibro::Kind::acceleration).back().value_count == 48);
  test::TestLink again(bench.loop);
  REQUIRE(bench.rig->attach("vibro", again, bench.loop));
  bench.loop.run_for(0.1);
  vibro::Splitter splitter;
  splitter.push(again.received);
  vibro::Frame frame;
  REQUIRE(splitter.next(frame));
  CHECK(frame.kind == vibro::Kind::description);
  CHECK(frame.device_us == 0);
  REQUIRE(splitter.next(frame));
  CHECK(frame.sequence == 0);
  CHECK(frame.device_us < 20'000);
}

TEST_CASE("pieces or datagrams, the frames are the same") {
  Bench whole(vibro_bench()), pieces(vibro_bench(R"({"largest_chunk_bytes": 7})")),
      datagrams(vibro_bench(R"({"largest_chunk_bytes": 7, "form": "datagram"})"));
  for (Bench* bench : {&whole, &pieces, &datagrams}) bench->loop.run_for(0.5);
  CHECK(whole.link.received == pieces.link.received);
  CHECK(whole.link.pieces == datagrams.link.pieces);
  CHECK(pieces.link.pieces.size() > 4 * whole.link.pieces.size());
}

}  // namespace vibro_emulator_test
