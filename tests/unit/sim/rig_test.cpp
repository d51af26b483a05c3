// The whole simulated bench through its bytes.

#include "sim/rig/rig.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "protocols/apt/bodies.hpp"
#include "protocols/apt/stage_scale.hpp"
#include "protocols/rdt/rdt.hpp"
#include "protocols/taxel/taxel.hpp"
#include "tests/unit/sim/support.hpp"

namespace rig_test {

using namespace weft;
using namespace weft::sim;
using test::hex;

namespace {

constexpr double counts_per_mm = 409600;

/// A host that sends raw bytes: z stage, y stage, force sensor and pads.
struct Host {
  explicit Host(const std::string& rig_json = test::bench17_text(), std::uint64_t seed = 1)
      : rig(test::make_rig(rig_json, seed)) {
    for (auto [name, link] : {std::pair{"stage.z", &z},
                              {"stage.y", &y},
                              {"stage.rx", &rx},
                              {"stage.ry", &ry},
                              {"ft", &ft},
                              {"taxels", &taxels}})
      REQUIRE(rig->attach(name, *link, loop).has_value());
    for (test::TestLink* stage : {&z, &y, &rx, &ry})
      stage->send(hex("10 02 01 01 50 01 43 04 01 00 50 01"));
    loop.run_for(10);
  }
  void move(test::TestLink* stage, double target_mm, double speed_mm_s) {
    const auto* model = protocols::apt::find_stage("LTS150");
    Bytes out;
    protocols::apt::append_message(
        out, protocols::apt::MessageId::set_velparams,
        protocols::apt::VelocityParams{
            1, 0, *protocols::apt::acceleration_to_counts(model->scale, 20),
            std::max(1, *protocols::apt::velocity_to_counts(model->scale, speed_mm_s))},
        {});
    protocols::apt::append_message(
        out, protocols::apt::MessageId::move_absolute,
        protocols::apt::ChannelCounts{1, static_cast<std::int32_t>(target_mm * counts_per_mm)}, {});
    stage->send(out);
  }
  void lower_to(double target_mm, double speed_mm_s) {
    z_target_mm = target_mm;
    move(&z, target_mm, speed_mm_s);
  }
  double force_n() {
    const auto record = protocols::rdt::decode_record(ft.pieces.back());
    return record->force_counts[2] / 1e6;
  }
  void start_force() {
    ft.send(hex("12 34 00 42 00 00 00 00"));
    ft.send(hex("12 34 00 02 00 00 00 00"));
    loop.run_for(0.02);
  }
  /// Lowers until the fabric carries the probe.
  void touch() {
    lower_to(70, 1);
    while (force_n() < 1.8) loop.run_for(0.01);
    stop_z();
  }
  void stop_z() {
    z.send(hex("65 04 01 02 50 01"));
    loop.run_for(0.5);
    const auto bytes = ByteView(z.received).last(20);
    const auto status = protocols::apt::decode_body<protocols::apt::StatusUpdate>(bytes.subspan(6));
    z_target_mm = status->position_counts / counts_per_mm;
  }
  /// Integral control at 100 Hz on the reading of the force sensor; returns the true rms error.
  double regulate(double set_n, double seconds) {
    double squares = 0;
    const int cycles = static_cast<int>(seconds * 100);
    for (int i = 0; i < cycles; ++i) {
      const double error = set_n - force_n();
      const double step_mm = std::clamp(0.1 * error / 2e4 * 1e3, -0.01, 0.01);
      if (std::abs(error) > 0.02) lower_to(z_target_mm + step_mm, 2);
      loop.run_for(0.01);
      squares += std::pow(rig->truth(loop.now()).contact_force_n - set_n, 2);
    }
    return std::sqrt(squares / cycles);
  }

  std::unique_ptr<Rig> rig;
  test::TestLoop loop;
  test::TestLink z{loop}, y{loop}, rx{loop}, ry{loop}, ft{loop}, taxels{loop};
  double z_target_mm = 0;
};

/// All bytes from the devices in one short trial.
Bytes trial(std::uint64_t seed, std::uint64_t patch, const std::string& level = "L1") {
  Host host(test::bench17_with({{"/simulation/level", '"' + level + '"'}}), seed);
  host.start_force();
  REQUIRE(host.rig->mount("terry", patch, host.loop.now()).has_value());
  host.touch();
  host.lower_to(host.z_target_mm + 0.5, 1);
  host.loop.run_for(2);
  Bytes all = host.z.received;
  for (const auto* link : {&host.ft, &host.taxels})
    all.insert(all.end(), link->received.begin(), link->received.end());
  return all;
}

}  // namespace

TEST_CASE("the probe rests with its own weight whatever the stage does within the slack") {
  Host host;
  host.start_force();
  REQUIRE(host.rig->mount("denim", 4, host.loop.now()).has_value());
  CHECK(host.rig->truth(host.loop.now()).contact_force_n == 0);
  host.touch();
  for (const double down_mm : {0.1, 0.2, 0.3}) {
    host.lower_to(host.z_target_mm + down_mm, 1);
    host.loop.run_for(3);
    CHECK(host.rig->truth(host.loop.now()).contact_force_n == Approx(1.96133).epsilon(1e-3));
    CHECK(host.force_n() == Approx(1.96).margin(0.08));
  }
}

TEST_CASE("a press is regulated through the bytes, standing and sliding, on soft and stiff cloth") {
  for (const auto& [fabric, level] : {std::pair{"pile", R"("L1")"},
                                      {"cotton", R"("L1")"},
                                      {"nylon", R"("L1")"},
                                      {"pile", R"("L2")"},
                                      {"nylon", R"("L2")"}}) {
    CAPTURE(fabric, level);
    Host host(test::bench17_with({{"/simulation/level", level}}));
    host.start_force();
    REQUIRE(host.rig->mount(fabric, 2, host.loop.now()).has_value());
    host.touch();
    host.regulate(5, 10);
    CHECK(host.regulate(5, 2) < 0.06);
    host.move(&host.y, 20, 2);
    CHECK(host.regulate(5, 9) < 0.05);
    const Truth truth = host.rig->truth(host.loop.now());
    CHECK(truth.fabric_point_m[1] == Approx(0.018).margin(1e-3));
    CHECK(truth.friction_n[1] > 0.3);  // dragged in the direction of the probe
  }
}

TEST_CASE("at level L0 a loop has its set point at once, and the weight before it presses") {
  Host host(test::bench17_with(
      {{"/simulation/level", R"("L0")"}, {"/simulation/traits", R"(["mean_level"])"}}));
  host.start_force();
  REQUIRE(host.rig->mount("nylon", 2, host.loop.now()).has_value());
  host.touch();
  CHECK(host.rig->truth(host.loop.now()).contact_force_n == Approx(1.96133));
  host.regulate(5, 5);
  CHECK(host.regulate(5, 2) == 0);
  host.move(&host.y, 20, 2);
  CHECK(host.regulate(5, 9) == 0);
  CHECK(host.rig->truth(host.loop.now()).friction_n[1] > 0.3);
}

TEST_CASE("the same seeds give the same bytes, another seed of either kind others") {
  const Bytes bytes = trial(1, 1);
  CHECK(bytes.size() > 10000);
  CHECK(bytes == trial(1, 1));
  CHECK(bytes != trial(2, 1));
  CHECK(bytes != trial(1, 2));
  const Bytes dynamic = trial(1, 1, "L2");
  CHECK(dynamic == trial(1, 1, "L2"));
  CHECK(dynamic != bytes);
}

TEST_CASE("a rig knows its devices and its fabrics, and refuses others") {
  auto rig = test::make_rig(test::bench17_text(), 1);
  test::TestLoop loop;
  test::TestLink link(loop);
  CHECK(rig->fabrics() == parse_fabrics(test::fabrics_text())->names());
  CHECK_FALSE(rig->attach("stage.w", link, loop).has_value());
  CHECK_FALSE(rig->mount("leather", 1, loop.now()).has_value());
  CHECK(rig->unmount(loop.now()).has_value());
}

TEST_CASE("a device that is attached again has been switched off and on") {
  Host host;
  test::TestLink again(host.loop);
  REQUIRE(host.rig->attach("stage.z", again, host.loop).has_value());
  again.send(hex("80 04 01 00 50 01"));
  CHECK(again.received == hex("81 04 0E 00 81 50 01 00 00 00 00 00 00 00 00 00 00 01 00 80"));
  const std::size_t reply = host.z.received.size();
  host.z.send(hex("80 04 01 00 50 01"));
  CHECK(host.z.received.size() == reply);
}

TEST_CASE("links and loop may outlive the rig") {
  test::TestLoop loop;
  test::TestLink link(loop);
  {
    auto rig = test::make_rig(test::bench17_text(), 1);
    REQUIRE(rig->attach("taxels", link, loop).has_value());
    loop.run_for(0.1);
  }
  const std::size_t reply = link.received.size();
  link.send(hex("01 02 03"));
  loop.run_for(1);
  CHECK(link.received.size() == reply);
}

TEST_CASE("a rig file with a fault is refused, with the place of the fault") {
  const auto where = [](const std::string& text) {
    const auto rig = Rig::create(text, test::fabrics_text(), 1);
    REQUIRE_FALSE(rig.has_value());
    return rig.error().where;
  };
  using test::bench17_with;
  CHECK(where("") == "rig file");
  CHECK(where("[1, 2]") == "rig file");
  CHECK(where(bench17_with({{"/simulation/slackk_mm", "1"}})) == "rig file: /simulation/slackk_mm");
  CHECK(where(bench17_with({{"/simulation/level", R"("L7")"}})) == "rig file: /simulation/level");
  for (const char* level : {R"("L0")", R"("Z")", R"("Z+")", R"("Auto")"})
    CHECK(where(bench17_with({{"/simulation/level", level}})) == "rig file: /simulation/level");
  for (const char* step : {"0", "-1", "60000", "1e308", R"("fine")"})
    CHECK(where(bench17_with({{"/simulation/step_us", step}})) == "rig file: /simulation/step_us");
  CHECK(where(bench17_with({{"/simulation/dynamics", R"({"lateral_stifness_n_m": 1e4})"}})) ==
        "rig file: /simulation/dynamics/lateral_stifness_n_m");
  CHECK(where(bench17_with({{"/simulation/dynamics", R"({"static_ratio": 0.5})"}})) ==
        "rig file: /simulation/dynamics/static_ratio");
  CHECK(where(bench17_with({{"/simulation/dynamics", R"({"integrator": "euler"})"}})) ==
        "rig file: /simulation/dynamics/integrator");
  CHECK(where(bench17_with({{"/simulation/mount_stiffness_n_m", "1e300"}})) ==
        "rig file: /simulation/mount_stiffness_n_m");
  CHECK(where(bench17_with({{"/simulation/pads/noise_counts", R"("much")"}})) ==
        "rig file: /simulation/pads/noise_counts");
  CHECK(where(bench17_with({{"/simulation/switches/relaxation", "1"}})) ==
        "rig file: /simulation/switches/relaxation");
  CHECK(where(bench17_with({{"/devices/0/emulator/kind", R"("robot")"}})) ==
        "rig file: /devices/0/emulator/kind");
  CHECK(where(bench17_with({{"/devices/0/emulator/stage", R"("LTS9")"}})) ==
        "rig file: /devices/0/emulator/stage");
  CHECK(where(bench17_with({{"/devices/0/emulator/travel_mm", "[5, 1]"}})) ==
        "rig file: /devices/0/emulator/travel_mm");
  CHECK(where(bench17_with({{"/devices/5/emulator/rate_hz", "0"}})) ==
        "rig file: /devices/5/emulator/rate_hz");
  CHECK(where(bench17_with({{"/devices/5/emulator/torque_unit", R"("lbf-in")"}})) ==
        "rig file: /devices/5/emulator/torque_unit");
  CHECK(where(bench17_with({{"/devices/1/name", R"("stage.x")"}})) == "rig file: /devices/1/name");
  CHECK(where(bench17_with({{"/plate/surface_z_mm", "null"}})) == "rig file: /plate/surface_z_mm");
  CHECK(where(bench17_with({{"/probe/mass_kg", "-1"}})) == "rig file: /probe/mass_kg");
  const auto bad_table = Rig::create(test::bench17_text(), "{", 1);
  REQUIRE_FALSE(bad_table.has_value());
  CHECK(bad_table.error().code == Errc::parse);
}

}  // namespace rig_test
