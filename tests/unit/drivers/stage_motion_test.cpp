#include <cmath>

#include "tests/unit/allocations.hpp"
#include "tests/unit/drivers/stage_bench.hpp"

namespace stage_motion_test {

using namespace weft;
using namespace weft::testing;
using apt::MessageId;

namespace {
constexpr auto nan_value = std::numeric_limits<double>::quiet_NaN();
constexpr Duration horizon = std::chrono::milliseconds(50);
const Bytes absolute_75mm = hex("53 04 06 00 D0 01 01 00 00 C0 D4 01");
const Bytes request_status = hex("80 04 01 00 50 01");

Bytes absolute(std::int32_t counts) {
  return apt::encode(
      apt::make_message(MessageId::move_absolute, apt::ChannelCounts{1, counts}, {}));
}
Bytes velocity(std::int32_t counts) {
  return apt::encode(
      apt::make_message(MessageId::set_velparams, apt::VelocityParams{1, 0, 90120, counts}, {}));
}
}  // namespace

TEST_CASE("a move to 75 mm sends the documented bytes and is done when device and position agree") {
  StageBench bench = StageBench::lts();
  bench.arm_lts();
  const Result<std::uint32_t> id = bench.driver->command(MoveCommand{0.075, 0.020});
  REQUIRE(id);
  CHECK(bench.link().take_written() == absolute_75mm);  // 20 mm/s was set while arming
  bench.receive_status(30720000, idle_homed);           // arrived, but not reported
  CHECK(bench.last_sample().move_id != *id);
  bench.receive(hex("64 04 0E 00 81 50 01 00 00 C0 D4 01 00 00 00 00 00 05 00 80"));
  CHECK(bench.last_sample().move_id == *id);
  CHECK(bench.last_sample().position == Approx(0.075).epsilon(1e-12));
  bench.loop().run_for(60);
  CHECK(bench.host.faults.empty());
}

TEST_CASE("a move of the rotation stage to 90 degrees sends the documented bytes") {
  StageBench bench = StageBench::prm();
  bench.arm_prm();
  const double deg = std::acos(-1.0) / 180;
  REQUIRE(bench.driver->command(MoveCommand{90 * deg, 10 * deg}));
  CHECK(bench.link().take_written() == hex("53 04 06 00 D0 01 01 00 E0 A2 02 00"));
  bench.receive(MessageId::move_completed, apt::DcStatusUpdate{1, 172770, 0, 0, idle_homed});
  CHECK(bench.last_sample().move_id == 1);  // two counts away: within the tolerance
}

TEST_CASE("another speed is sent once, before the move") {
  StageBench bench = StageBench::lts();
  bench.arm_lts();
  REQUIRE(bench.driver->command(MoveCommand{0.075, 0.002}));
  CHECK(bench.link().take_written() == velocity(43974656) + absolute_75mm);
  bench.receive_completed(30720000);
  REQUIRE(bench.driver->command(MoveCommand{0.075, 0.002}));
  CHECK(bench.link().take_written() == absolute_75mm);
}

TEST_CASE("numbers of motions rise by one, and only the confirmed one is in the samples") {
  StageBench bench = StageBench::lts();
  bench.arm_lts();
  CHECK(bench.driver->command(MoveCommand{0.010, 0.02}).value() == 1);
  CHECK(bench.driver->command(MoveCommand{0.020, 0.02}).value() == 2);
  bench.receive_completed(4096000);  // the end of the first move, which was replaced
  CHECK(bench.last_sample().move_id == 0);
  bench.receive_completed(8192000);
  CHECK(bench.last_sample().move_id == 2);
  CHECK(bench.driver->command(PollCommand{}).value() == 0);
  CHECK(bench.driver->command(HomeCommand{}).value() == 3);
}

TEST_CASE("completion reported elsewhere than at the target is no success but ends in a fault") {
  StageBench bench = StageBench::lts();
  bench.arm_lts();
  REQUIRE(bench.driver->command(MoveCommand{0.001, 0.02}));
  bench.link().take_written();
  bench.receive_completed(409605);  // five counts away
  CHECK(bench.last_sample().move_id == 0);
  CHECK(bench.link().take_written() == request_status);
  for (int i = 0; i < 30 && bench.host.faults.empty(); ++i) {
    bench.receive_status(409605, idle_homed);
    bench.loop().run_for(0.25);
  }
  CHECK(bench.fault_code() == Errc::device_motion);
  CHECK(bench.host.faults[0].expected == "409600 counts");
  CHECK(bench.host.faults[0].got == "409605 counts");
}

// APT16's figure of MOVE_COMPLETED has a short header
TEST_CASE("a completion without a body is believed when a status at rest agrees") {
  StageBench bench = StageBench::lts();
  bench.arm_lts();
  REQUIRE(bench.driver->command(MoveCommand{0.075, 0.02}));
  bench.link().take_written();
  bench.receive(hex("64 04 01 00 01 50"));
  CHECK(bench.link().take_written() == request_status);
  bench.receive_status(30720000, moving_homed);
  CHECK(bench.last_sample().move_id == 0);
  bench.receive_status(30720000, idle_homed);
  CHECK(bench.last_sample().move_id == 1);
}

TEST_CASE("a move that takes much longer than its distance and speed allow is a fault") {
  StageBench bench = StageBench::lts();
  bench.arm_lts();
  REQUIRE(bench.driver->command(MoveCommand{0.040, 0.020}));  // ideal: 2 s + 1 s of ramps
  std::int32_t counts = 0;
  for (int i = 0; i < 60; ++i) {  // moves slowly for 6 s
    bench.loop().run_for(0.1);
    bench.receive_status(counts += 1000, moving_homed);
  }
  CHECK(bench.host.faults.empty());
  bench.loop().run_for(1);  // the limit: 1.5 * 3 s + 2 s
  CHECK(bench.fault_code() == Errc::timeout);
  CHECK(bench.host.faults[0].expected == "40.0000 mm");
}

TEST_CASE("a move that begins while the stage brakes has the time to come back") {
  StageBench bench = StageBench::lts();
  bench.arm_lts();
  REQUIRE(bench.driver->command(ServoCommand{4e-3, horizon}));
  bench.receive_status(409600, moving_homed);
  REQUIRE(bench.driver->command(ServoCommand{0, horizon}));
  REQUIRE(bench.driver->command(ServoCommand{0.05e-3, horizon}));  // it cannot be that slow yet
  REQUIRE(bench.driver->command(MoveCommand{1e-3, 0.05e-3}));
  std::int32_t counts = 409600 + 163840;  // decelerated by 20 mm/s2
  const auto creep = [&](int steps) {
    for (int i = 0; i < steps && bench.host.faults.empty(); ++i) {
      bench.loop().run_for(0.1);
      bench.receive_status(counts -= 2048, moving_homed);
    }
  };
  creep(80);  // the way back
  CHECK(bench.host.faults.empty());
  creep(200);  // and further
  CHECK(bench.fault_code() == Errc::timeout);
}

TEST_CASE("a stage that does not move is found out before the time limit") {
  StageBench bench = StageBench::lts();
  bench.arm_lts();
  REQUIRE(bench.driver->command(MoveCommand{0.150, 0.002}));  // 75 s
  double waited_s = 0;
  for (; bench.host.faults.empty() && waited_s < 60; waited_s += 0.25) {
    bench.loop().run_for(0.25);
    if (bench.host.faults.empty()) bench.receive_status(0, moving_homed);
  }
  CHECK(bench.fault_code() == Errc::device_motion);
  CHECK(waited_s < 4);
}

TEST_CASE("without polls from the host a motion is watched by the driver's own requests") {
  StageBench bench = StageBench::lts();
  bench.arm_lts();
  REQUIRE(bench.driver->command(MoveCommand{0.1, 0.02}));
  bench.link().take_written();
  bench.loop().run_for(0.26);
  CHECK(bench.link().take_written() == request_status);
}

TEST_CASE("an unrequested stop is a fault; a requested one is not") {
  StageBench limit = StageBench::lts();
  limit.arm_lts();
  REQUIRE(limit.driver->command(MoveCommand{0.1, 0.02}));
  limit.receive_stopped(4096, 0x80000501);
  CHECK(limit.fault_code() == Errc::device_motion);

  StageBench requested = StageBench::lts();
  requested.arm_lts();
  REQUIRE(requested.driver->command(ServoCommand{0.002, horizon}));
  REQUIRE(requested.driver->command(ServoCommand{0, horizon}));
  REQUIRE(requested.driver->command(MoveCommand{0.1, 0.02}));
  requested.receive_stopped(4096);  // belongs to the servo motion
  CHECK(requested.host.faults.empty());
  requested.receive_completed(40960000);
  CHECK(requested.last_sample().move_id == 1);
}

TEST_CASE("targets, speeds and horizons outside the limits are refused and nothing is sent") {
  StageBench bench = StageBench::lts(R"(, "travel_mm": [5, 100], "max_speed_mm_s": 10)");
  bench.arm_lts(4096000);
  const double inf = std::numeric_limits<double>::infinity();
  const Command refused[] = {MoveCommand{0.0049, 0.001},       MoveCommand{0.1001, 0.001},
                             MoveCommand{-1, 0.001},           MoveCommand{nan_value, 0.001},
                             MoveCommand{inf, 0.001},          MoveCommand{1e300, 0.001},
                             MoveCommand{0.05, 0.0101},        MoveCommand{0.05, 0},
                             MoveCommand{0.05, -0.001},        MoveCommand{0.05, nan_value},
                             MoveCommand{0.05, inf},           ServoCommand{0.0101, horizon},
                             ServoCommand{-0.0101, horizon},   ServoCommand{nan_value, horizon},
                             ServoCommand{0.001, Duration(0)}, ServoCommand{0.001, Duration(-1)}};
  for (const Command& command : refused) {
    const Result<std::uint32_t> result = bench.driver->command(command);
    REQUIRE_FALSE(result);
    CHECK(result.error().code == Errc::range);
  }
  CHECK(bench.link().take_written().empty());
  CHECK(bench.driver->state() == DriverState::armed);
  CHECK(bench.driver->command(MoveCommand{0.1, 0.01}));  // the limits themselves are allowed
  CHECK(bench.driver->command(MoveCommand{0.005, 0.01}));
}

TEST_CASE("a stage that is not homed moves only to its home") {
  StageBench bench = StageBench::lts();
  bench.arm_lts(0, idle_not_homed);
  CHECK(bench.driver->command(MoveCommand{0.01, 0.01}).error().code == Errc::wrong_state);
  CHECK(bench.driver->command(ServoCommand{0.01, horizon}).error().code == Errc::wrong_state);
  CHECK(bench.driver->command(HomeCommand{}));
  StageBench bold = StageBench::lts(R"(, "require_homed": false)");
  bold.arm_lts(0, idle_not_homed);
  CHECK(bold.driver->command(MoveCommand{0.01, 0.01}));
}

TEST_CASE("a move marked for it is made before homing and beyond the travel; others are not") {
  StageBench bench = StageBench::lts();
  bench.arm_lts(0, idle_not_homed);
  bench.link().take_written();
  REQUIRE(bench.driver->command(MoveCommand{-0.008, 0.0004, true}));
  CHECK_FALSE(bench.link().take_written().empty());
  StageBench homed_stage = StageBench::lts();
  homed_stage.arm_lts(0);
  homed_stage.link().take_written();
  const auto beyond = homed_stage.driver->command(MoveCommand{-0.008, 0.0004, true});
  REQUIRE_FALSE(beyond);
  CHECK(beyond.error().code == Errc::range);
  CHECK(homed_stage.link().take_written().empty());
}

TEST_CASE("homing is done when the device reports it and its status has the homed bit") {
  StageBench bench = StageBench::lts();
  bench.arm_lts(4096000, idle_not_homed);
  const std::uint32_t id = bench.driver->command(HomeCommand{}).value();
  CHECK(bench.link().take_written() == hex("43 04 01 00 50 01"));
  bench.receive_status(2048000, homing);
  bench.receive(hex("44 04 01 00 01 50"));
  CHECK(bench.last_sample().move_id == 0);
  CHECK(bench.link().take_written() == request_status);
  bench.receive_status(0, idle_homed);
  CHECK(bench.last_sample().move_id == id);
  CHECK(bench.last_sample().homed);
  CHECK(bench.loop().timers() <= 1);  // an expiring reply watchdog
  bench.loop().run_for(300);
  CHECK(bench.host.faults.empty());
}

TEST_CASE("homing that ends without the homed bit, or never ends, is a fault") {
  StageBench lying = StageBench::lts();
  lying.arm_lts(0, idle_not_homed);
  REQUIRE(lying.driver->command(HomeCommand{}));
  lying.receive(hex("44 04 01 00 01 50"));
  lying.receive_status(0, idle_not_homed);
  CHECK(lying.fault_code() == Errc::device_motion);

  StageBench endless = StageBench::lts(R"(, "home_timeout_s": 10)");
  endless.arm_lts(0, idle_not_homed);
  REQUIRE(endless.driver->command(HomeCommand{}));
  double waited_s = 0;
  for (std::int32_t counts = 0; endless.host.faults.empty() && waited_s < 60; waited_s += 0.25) {
    endless.receive_status(counts += 100, homing);
    endless.loop().run_for(0.25);
  }
  CHECK(endless.fault_code() == Errc::timeout);
  CHECK(waited_s == Approx(10).margin(0.3));
}

TEST_CASE(
    "each stage is given the time that homing over its whole travel takes, and not much more") {
  struct Case {
    const char* stage;
    const char* model;
    std::uint16_t stage_id;
    double slowest_s;  // device-facts.md, APT stage data: 150 mm at 2 and 1 mm/s, 360 degrees at
                       // 10 and 2 deg/s
  };
  for (const Case& c : {Case{"LTS150", "LTS150", 0, 75},
                        {"NRT150", "BSC201", 0, 150},
                        {"PRM1-Z8", "KDC101", 6, 36},
                        {"CR1-Z7", "KDC101", 5, 180}}) {
    INFO(c.stage);
    StageBench bench(R"({"stage": ")" + std::string(c.stage) + R"("})");
    const bool servo = std::string(c.model) == "KDC101";
    const auto status = [&](std::int32_t counts, std::uint32_t bits) {
      servo ? bench.receive_dc_status(counts, bits) : bench.receive_status(counts, bits);
    };
    REQUIRE(bench.driver->open());
    bench.receive_info(c.model, c.stage_id);
    REQUIRE(bench.driver->arm());
    status(0, idle_not_homed);
    REQUIRE(bench.driver->command(HomeCommand{}));
    double waited_s = 0;
    for (std::int32_t counts = 0; bench.host.faults.empty() && waited_s < 1000; waited_s += 0.25) {
      status(counts += 100, homing);
      bench.loop().run_for(0.25);
    }
    CHECK(bench.fault_code() == Errc::timeout);
    CHECK(waited_s > 1.2 * c.slowest_s);
    CHECK(waited_s < 2 * c.slowest_s);
  }
}

TEST_CASE("a velocity command is a finite move from the last position") {
  StageBench bench = StageBench::lts();
  bench.arm_lts(4096000);                                         // 10 mm
  REQUIRE(bench.driver->command(ServoCommand{-0.002, horizon}));  // 100 um back
  CHECK(bench.link().take_written() == velocity(43974656) + absolute(4096000 - 40960));
  bench.receive_status(4096000 - 8192, moving_homed);
  REQUIRE(bench.driver->command(ServoCommand{0.002, horizon}));  // same speed, other direction
  CHECK(bench.link().take_written() == absolute(4096000 - 8192 + 40960));
}

TEST_CASE("a velocity command never leads out of the travel") {
  StageBench bench = StageBench::lts(R"(, "travel_mm": [5, 15])");
  bench.arm_lts(4096000);
  REQUIRE(bench.driver->command(ServoCommand{0.02, std::chrono::hours(1)}));
  CHECK(bench.link().take_written() == absolute(15 * 409600));
  REQUIRE(bench.driver->command(ServoCommand{-0.02, Duration::max()}));
  CHECK(bench.link().take_written() == absolute(5 * 409600));
}

TEST_CASE("velocity zero stops a moving stage once, and sends nothing to one at rest") {
  StageBench bench = StageBench::lts();
  bench.arm_lts(4096000);
  REQUIRE(bench.driver->command(ServoCommand{0, horizon}));
  CHECK(bench.link().take_written().empty());
  REQUIRE(bench.driver->command(ServoCommand{0.002, horizon}));
  bench.link().take_written();
  REQUIRE(bench.driver->command(ServoCommand{0, horizon}));  // no status has shown motion yet
  CHECK(bench.link().take_written() == hex("65 04 01 02 50 01"));
  bench.receive_status(4096100, moving_homed);  // still slowing down
  REQUIRE(bench.driver->command(ServoCommand{0, horizon}));
  CHECK(bench.link().take_written().empty());
  bench.receive_stopped(4096200);
  REQUIRE(bench.driver->command(ServoCommand{0, horizon}));
  CHECK(bench.link().take_written().empty());
}

TEST_CASE("velocity zero is a profiled stop whatever its horizon, and before homing too") {
  StageBench bench = StageBench::lts();
  bench.arm_lts(4096000);
  REQUIRE(bench.driver->command(MoveCommand{0.1, 0.02}));
  bench.link().take_written();
  REQUIRE(bench.driver->command(ServoCommand{}));
  CHECK(bench.link().take_written() == hex("65 04 01 02 50 01"));
  StageBench homing_stage = StageBench::lts();
  homing_stage.arm_lts(4096000, idle_not_homed);
  REQUIRE(homing_stage.driver->command(HomeCommand{}));
  homing_stage.receive_status(4000000, homing);
  homing_stage.link().take_written();
  REQUIRE(homing_stage.driver->command(ServoCommand{}));
  CHECK(homing_stage.link().take_written() == hex("65 04 01 02 50 01"));
}

TEST_CASE("a velocity command replaces a move, which is then never confirmed") {
  StageBench bench = StageBench::lts();
  bench.arm_lts();
  REQUIRE(bench.driver->command(MoveCommand{0.001, 0.02}));
  REQUIRE(bench.driver->command(ServoCommand{0.001, horizon}));
  bench.receive_completed(409600);
  CHECK(bench.last_sample().move_id == 0);
  bench.loop().run_for(100);
  CHECK(bench.host.faults.empty());
}

TEST_CASE("stop ends the motion at once, and the stage stays armed") {
  StageBench bench = StageBench::lts();
  bench.driver->stop();
  CHECK(bench.link().take_written().empty());  // no connection yet
  bench.arm_lts();
  REQUIRE(bench.driver->command(MoveCommand{0.1, 0.02}));
  bench.link().take_written();
  bench.driver->stop();
  CHECK(bench.link().take_written() == hex("65 04 01 01 50 01"));
  bench.receive_stopped(4096);
  bench.loop().run_for(100);
  CHECK(bench.host.faults.empty());
  CHECK(bench.driver->state() == DriverState::armed);
  CHECK(bench.last_sample().move_id == 0);
}

TEST_CASE("the servo path and the status path allocate nothing in steady state") {
  StageBench bench = StageBench::prm();
  bench.arm_prm(19196);
  bench.link().record = bench.host.record = false;
  const Bytes status = apt::encode(apt::make_message(
      MessageId::get_dcstatusupdate, apt::DcStatusUpdate{1, 19200, 0, 0, moving_homed},
      {apt::address::host, apt::address::usb_unit}));
  const auto cycle = [&](int i) {
    REQUIRE(bench.driver->command(ServoCommand{0.01 + 1e-4 * (i % 7), horizon}));
    REQUIRE(bench.driver->command(PollCommand{}));
    bench.link().deliver(status, bench.loop().now());
  };
  for (int i = 0; i < 50; ++i) cycle(i);
  const std::size_t before = allocations();
  std::size_t failures = 0;
  for (int i = 0; i < 1000; ++i) {
    failures += bench.driver->command(ServoCommand{0.01 + 1e-4 * (i % 7), horizon}) ? 0U : 1U;
    failures += bench.driver->command(PollCommand{}) ? 0U : 1U;
    bench.link().deliver(status, bench.loop().now());
  }
  CHECK(allocations() - before == 0);
  CHECK(failures == 0);
  CHECK(bench.host.published == 1051);
}

}  // namespace stage_motion_test
