// Driver and emulated controller together: every stage of the table, missing reports, and
// controllers with other parameters.

#include "tests/unit/daemon/hardware/stage_world.hpp"

#include "tests/unit/hex.hpp"

namespace stage_world_test {

using namespace weft;
using namespace weft::testing;
namespace apt = protocols::apt;

namespace {

sim::AptStageParams unit_of(const apt::StageModel& model) {
  sim::AptStageParams params;
  params.stage = &model;
  params.model = model.usual_controller;
  params.axis = model.axis == apt::Axis::linear ? sim::AxisId::x : sim::AxisId::rx;
  return params;
}

sim::AptStageParams unit_of(const char* stage, const char* controller) {
  sim::AptStageParams params = unit_of(*apt::find_stage(stage, controller));
  params.model = controller;
  return params;
}

double home_limit_s(const apt::StageModel& model) {
  return 20 + 2 * (2 + 2 * model.home_offset) / model.home_speed;
}

/// Sends the bytes of another program to the controller.
void tell(StageWorld& world, const std::string& bytes) {
  sim::ByteSink unheard = [](ByteView) {};
  world.emulator.receive(hex(bytes), world.host.loop_.now(), unheard);
}

Bytes answer_of(StageWorld& world, const std::string& request) {
  Bytes out;
  sim::ByteSink sink = [&](ByteView bytes) { out.insert(out.end(), bytes.begin(), bytes.end()); };
  world.emulator.receive(hex(request), world.host.loop_.now(), sink);
  return out;
}

}  // namespace

TEST_CASE("every stage of the table homes and moves where it is sent") {
  for (const apt::StageModel& model : apt::stage_models()) {
    INFO(model.name);
    StageWorld world(unit_of(model));
    REQUIRE(world.bring_up());
    const auto homed = world.driver->command(HomeCommand{});
    REQUIRE(homed);
    REQUIRE(world.done(*homed, home_limit_s(model)));
    const double si = sim::si_per_unit(model);
    const double target = 3 * si, speed = std::min(2.0, model.max_speed) * si;
    const auto moved = world.driver->command(MoveCommand{.target = target, .speed = speed});
    REQUIRE(moved);
    REQUIRE(world.done(*moved, 30));
    const double tolerance = 5 / model.scale.counts_per_unit * si;
    CHECK(world.sample().position == Approx(target).margin(tolerance));
    const auto axis = model.axis == apt::Axis::linear ? sim::AxisId::x : sim::AxisId::rx;
    const double truth = world.bench_plant.stage(axis).position(world.host.loop_.now());
    CHECK(truth == Approx(target).margin(tolerance));
    CHECK(world.host.faults.empty());
  }
}

TEST_CASE("a stage on a controller of another scale moves as far where the rig file states it") {
  StageWorld world(unit_of("NRT150", "BSC101"), R"(, "controller": "BSC101")");
  REQUIRE(world.bring_up());
  const auto homed = world.driver->command(HomeCommand{});
  REQUIRE(world.done(*homed, 30));
  const auto moved = world.driver->command(MoveCommand{.target = 0.005, .speed = 0.005});
  REQUIRE(moved);
  REQUIRE(world.done(*moved, 10));
  CHECK(world.bench_plant.stage(sim::AxisId::x).position(world.host.loop_.now()) ==
        Approx(0.005).margin(2e-7));
  StageWorld unstated(unit_of("NRT150", "BSC101"));
  CHECK_FALSE(unstated.bring_up());
  CHECK(unstated.fault_code() == Errc::device_identity);
}

TEST_CASE("ends that are never reported are taken from the status: home, move and stop") {
  for (const auto& [stage, controller] :
       {std::pair{"LTS150", "LTS150"}, {"PRM1-Z8", "KDC101"}, {"DDS220", "KBD101"}}) {
    INFO(stage);
    const apt::StageModel& model = *apt::find_stage(stage);
    const double si = sim::si_per_unit(model);
    sim::FaultBoard board(1);
    board.add({.kind = sim::FaultKind::no_completion});
    StageWorld world(unit_of(stage, controller));
    world.emulator.attach_faults(board);
    REQUIRE(world.bring_up());
    const auto homed = world.driver->command(HomeCommand{});
    REQUIRE(homed);
    REQUIRE(world.done(*homed, home_limit_s(model)));
    CHECK(world.logged("end of homing not reported"));
    const auto moved = world.driver->command(MoveCommand{.target = 3 * si, .speed = 2 * si});
    REQUIRE(moved);
    REQUIRE(world.done(*moved, 10));
    CHECK(world.logged("end of a move not reported"));
    REQUIRE(world.driver->command(MoveCommand{.target = 5 * si, .speed = 1 * si}));
    world.run(0.5);
    world.driver->stop();
    world.run(0.5);
    const auto back = world.driver->command(MoveCommand{.target = 2 * si, .speed = 2 * si});
    REQUIRE(back);
    REQUIRE(world.done(*back, 10));
    CHECK(world.host.faults.empty());
  }
}

TEST_CASE("a controller that was left otherwise is set when it is armed") {
  for (const auto& [stage, controller] :
       {std::pair{"NRT150", "SCC201"}, {"MTS50-Z8", "KDC101"}, {"DDSM100", "KBD101"}}) {
    INFO(controller);
    const apt::StageModel& model = *apt::find_stage(stage);
    StageWorld world(unit_of(stage, controller));
    tell(world, "E3 04 0C 00 D0 01 01 00 02 00 01 00 00 00 00 00 00 00");  // brushless: S-curve
    tell(world, "13 04 0E 00 D0 01 01 00 00 00 00 00 01 00 00 00 02 00 00 00");  // a crawl
    tell(world,
         "23 04 10 00 D0 01 01 00 01 00 01 00 00 00 00 00 00 00 00 00 01 00");  // no switches
    tell(world,
         "16 04 16 00 D0 01 01 00 01 00 01 00 00 00 00 00 00 00 01 00 00 00 01 00 00 00 01 00");
    tell(world, "3A 04 06 00 D0 01 01 00 20 4E 00 00");  // backlash
    tell(world,
         "40 04 0E 00 D0 01 01 00 01 00 04 00 01 00 00 00 00 00 00 00");  // home to the other end
    tell(world, "F4 04 04 00 D0 01 01 00 01 00");                         // the softest S-curve
    tell(world, "6B 04 01 00 50 01");                                     // no end-of-move messages
    tell(world, "11 00 00 00 50 01");                                     // updates run
    tell(world, "10 02 01 02 50 01");                                     // disabled
    REQUIRE(world.bring_up());
    const auto homed = world.driver->command(HomeCommand{});
    REQUIRE(homed);
    REQUIRE(world.done(*homed, home_limit_s(model)));
    CHECK_FALSE(world.logged("not reported"));
    const auto moved = world.driver->command(MoveCommand{.target = 0.003, .speed = 0.002});
    REQUIRE(moved);
    REQUIRE(world.done(*moved, 8));
    CHECK_FALSE(world.logged("not reported"));
    CHECK(world.host.faults.empty());
    const auto params = apt::decode(answer_of(world, "3B 04 01 00 50 01"));
    CHECK(apt::decode_body<apt::ChannelCounts>(params->data)->value_counts == 0);
    const auto profile = apt::decode(answer_of(world, "E4 04 01 00 50 01"));
    CHECK(apt::decode_body<apt::ProfileMode>(profile->data)->mode ==
          (model.is_brushless() ? 0 : 2));
    const std::size_t before = world.host.published;
    world.run(1);  // without a request no report comes
    CHECK(world.host.published - before <= 1);
  }
}

TEST_CASE("a motion that was left running is stopped when the stage is armed") {
  for (const auto& [stage, controller, towards_the_end] :
       {std::tuple{"LTS150", "LTS150", "57 04 01 01 50 01"},
        {"MTS50-Z8", "KDC101", "57 04 01 02 50 01"}}) {
    INFO(controller);
    StageWorld world(unit_of(stage, controller));
    tell(world, "10 02 01 01 50 01");
    tell(world, towards_the_end);
    world.run(0.5);
    const auto& carriage = world.bench_plant.stage(sim::AxisId::x);
    REQUIRE(carriage.velocity(world.host.loop_.now()) > 0);
    REQUIRE(world.bring_up());
    world.run(2);
    CHECK(carriage.velocity(world.host.loop_.now()) == 0);
    CHECK(carriage.position(world.host.loop_.now()) < 0.05);
    CHECK(world.logged("was moving when it was armed"));
    const auto homed = world.driver->command(HomeCommand{});
    REQUIRE(homed);
    CHECK(world.done(*homed, 60));
    CHECK(world.host.faults.empty());
  }
}

TEST_CASE("soft limits inside the rig file's travel are refused, wider ones kept") {
  const auto with_soft_limits = [](const char* bytes) {
    auto world = std::make_unique<StageWorld>(unit_of("LTS150", "LTS150"));
    tell(*world, bytes);
    return world;
  };
  // -1 to 10 mm, and -1 to 200 mm; profiled stop
  auto inside =
      with_soft_limits("23 04 10 00 D0 01 01 00 02 00 02 00 00 80 3E 00 00 C0 F9 FF 03 00");
  CHECK_FALSE(inside->bring_up());
  CHECK(inside->fault_code() == Errc::device_settings);
  auto wider =
      with_soft_limits("23 04 10 00 D0 01 01 00 02 00 02 00 00 00 E2 04 00 C0 F9 FF 03 00");
  CHECK(wider->bring_up());
  const auto stored = apt::decode(answer_of(*wider, "24 04 01 00 50 01"));
  CHECK(apt::decode_body<apt::LimitSwitchParams>(stored->data)->forward_soft_counts == 81920000);
}

}  // namespace stage_world_test
