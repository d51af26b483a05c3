#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "tests/unit/drivers/stage_bench.hpp"

namespace stage_lifecycle_test {

using namespace weft;
using namespace weft::testing;
using apt::MessageId;

// Byte strings with a source are in protocols/apt/vectors; those here are the bytes that a driver
// must send.

TEST_CASE("opening a servo stage sends what thorpy was seen to send, and waits for the model") {
  StageBench bench = StageBench::prm();
  REQUIRE(bench.driver->open());
  CHECK(bench.link().take_written() == hex("18 00 00 00 50 01") + hex("12 00 00 00 50 01") +
                                           hex("05 00 00 00 50 01") + hex("24 04 01 00 50 01"));
  CHECK(bench.driver->state() == DriverState::closed);
  bench.receive_info("KDC101", 6);
  CHECK(bench.driver->state() == DriverState::open);
  CHECK(bench.host.states == std::vector{DriverState::open});
  REQUIRE(bench.host.identities.size() == 1);
  const auto identity = nlohmann::json::parse(to_json(bench.host.identities[0]));
  CHECK(identity.at("reported").at("model") == "KDC101");
  CHECK(identity.at("reported").at("serial") == "45000001");
  CHECK(identity.at("reported").at("stage_id") == "6");
  CHECK(identity.at("scale").at("counts_per_rad") ==
        Approx(1919.6418578623391 * 180 / std::acos(-1)));
}

TEST_CASE("the identity of the controller is published with its firmware before it is open") {
  StageBench bench = StageBench::lts();
  REQUIRE(bench.driver->open());
  CHECK(bench.host.identities.empty());
  apt::HardwareInfo info;
  info.serial = 45123456;
  info.model = apt::Text<8>::from("LTS150");
  info.firmware_major = 3;
  info.firmware_minor = 9;
  info.notes = apt::Text<48>::from("caf\xE9");  // Latin-1, not UTF-8
  bench.receive(MessageId::hw_get_info, info);
  REQUIRE(bench.host.identities.size() == 1);
  const auto identity = nlohmann::json::parse(to_json(bench.host.identities[0]));
  CHECK(identity.at("reported").at("serial") == "45123456");
  CHECK(identity.at("reported").at("firmware") == "3.0.9");
  CHECK(identity.at("scale").at("counts_per_m") == counts_per_m);
}

TEST_CASE("opening an LTS150 leaves out the message that it does not list") {
  StageBench bench = StageBench::lts();
  REQUIRE(bench.driver->open());
  CHECK(bench.link().take_written() ==
        hex("12 00 00 00 50 01") + hex("05 00 00 00 50 01") + hex("24 04 01 00 50 01"));
}

TEST_CASE("a bay controller is spoken to under its own address") {
  StageBench bench = StageBench::lts(R"(, "destination": 34)");
  REQUIRE(bench.driver->open());
  CHECK(bench.link().take_written() ==
        hex("12 00 00 00 22 01") + hex("05 00 00 00 22 01") + hex("24 04 01 00 22 01"));
  bench.receive_info("LTS150");  // from 0x50: not our unit
  CHECK(bench.driver->state() == DriverState::closed);
}

TEST_CASE("arming an LTS150 sends the documented bytes and ends with the first status") {
  StageBench bench = StageBench::lts();
  REQUIRE(bench.driver->open());
  bench.receive_info("LTS150");
  bench.link().take_written();
  REQUIRE(bench.driver->arm());
  CHECK(bench.link().take_written() ==
        hex("10 02 01 01 50 01") +
            hex("13 04 0E 00 D0 01 01 00 00 00 00 00 08 60 01 00 00 00 36 1A") +
            hex("40 04 0E 00 D0 01 01 00 02 00 01 00 00 00 9F 02 00 20 03 00") +
            hex("23 04 10 00 D0 01 01 00 02 00 02 00 00 00 00 00 00 00 00 00 01 00") +
            hex("3A 04 06 00 D0 01 01 00 00 00 00 00") + hex("F4 04 04 00 D0 01 01 00 00 00") +
            hex("14 04 01 00 50 01") + hex("24 04 01 00 50 01") + hex("80 04 01 00 50 01"));
  CHECK(bench.driver->state() == DriverState::open);
  CHECK(bench.driver->arm().error().code == Errc::wrong_state);  // already under way
  bench.receive(hex("81 04 0E 00 81 50 01 00 00 80 3E 00 00 00 00 00 10 05 00 80"));
  CHECK(bench.host.states == std::vector{DriverState::open, DriverState::armed});
  CHECK(bench.last_sample().position == Approx(0.010).epsilon(1e-12));
  CHECK(bench.last_sample().moving);
  CHECK(bench.last_sample().homed);
  CHECK(bench.last_sample().move_id == 0);
}

TEST_CASE("arming a PRM1-Z8 sends the documented velocity and asks for the DC status") {
  StageBench bench = StageBench::prm();
  REQUIRE(bench.driver->open());
  bench.receive_info("KDC101", 6);
  bench.link().take_written();
  REQUIRE(bench.driver->arm());
  const Bytes written = bench.link().take_written();
  const Bytes begin =
      hex("10 02 01 01 50 01") + hex("13 04 0E 00 D0 01 01 00 00 00 00 00 93 00 00 00 69 8D 06 00");
  const Bytes end = hex("90 04 01 00 50 01");
  REQUIRE(written.size() > begin.size() + end.size());
  CHECK(Bytes(written.begin(), written.begin() + 26) == begin);
  CHECK(Bytes(written.end() - 6, written.end()) == end);
  bench.receive(hex("91 04 0E 00 81 50 01 00 0B 1F FF FF 00 00 00 00 10 05 00 80"));
  REQUIRE(bench.driver->state() == DriverState::armed);
  CHECK(bench.last_sample().position == Approx(-30 * 3.14159265358979 / 180).epsilon(1e-5));
}

TEST_CASE("a channel that does not become enabled is a fault, not an armed stage") {
  StageBench bench = StageBench::lts();
  REQUIRE(bench.driver->open());
  bench.receive_info("LTS150");
  REQUIRE(bench.driver->arm());
  bench.receive_status(0, 0x00000100);
  CHECK(bench.fault_code() == Errc::device_refused);
  CHECK(bench.host.samples.empty());
}

TEST_CASE("a controller that stays silent faults on opening, on arming and on a poll") {
  StageBench opening = StageBench::lts(R"(, "reply_timeout_s": 0.5)");
  REQUIRE(opening.driver->open());
  opening.loop().run_for(0.49);
  CHECK(opening.host.faults.empty());
  opening.loop().run_for(0.02);
  CHECK(opening.fault_code() == Errc::timeout);

  StageBench arming = StageBench::lts(R"(, "reply_timeout_s": 0.5)");
  REQUIRE(arming.driver->open());
  arming.receive_info("LTS150");
  REQUIRE(arming.driver->arm());
  arming.loop().run_for(0.51);
  CHECK(arming.fault_code() == Errc::timeout);

  StageBench polling = StageBench::lts(R"(, "reply_timeout_s": 0.5)");
  polling.arm_lts();
  polling.loop().run_for(5);  // nothing requested, nothing missed
  CHECK(polling.host.faults.empty());
  for (int i = 0; i < 10; ++i) {
    REQUIRE(polling.driver->command(PollCommand{}));
    polling.loop().run_for(0.04);
  }
  CHECK(polling.link().take_written().size() == 60);
  CHECK(polling.host.faults.empty());
  polling.loop().run_for(0.2);  // counted from the first unanswered request
  CHECK(polling.fault_code() == Errc::timeout);
}

TEST_CASE("each answer to a poll is published with the time of its arrival") {
  StageBench bench = StageBench::lts();
  bench.arm_lts();
  for (int i = 1; i <= 3; ++i) {
    REQUIRE(bench.driver->command(PollCommand{}));
    CHECK(bench.link().take_written() == hex("80 04 01 00 50 01"));
    bench.loop().run_for(0.25);
    bench.receive_status(i * 4096, i == 3 ? 0x80000502 : moving_homed);
    CHECK(bench.host.samples.back().host == bench.loop().now());
    CHECK(bench.last_sample().position == Approx(i * 10e-6).epsilon(1e-12));
    CHECK(bench.last_sample().moving == (i != 3));
    CHECK(bench.last_sample().limit == (i == 3));
  }
  CHECK(bench.host.samples[1].sequence == bench.host.samples[0].sequence + 1);
}

TEST_CASE("with poll_hz the driver asks by itself") {
  StageBench bench = StageBench::lts(R"(, "poll_hz": 20)");
  bench.arm_lts();
  for (int i = 0; i < 20; ++i) {
    bench.loop().run_for(0.05);
    CHECK(bench.link().take_written() == hex("80 04 01 00 50 01"));
    bench.receive_status(0, idle_homed);
  }
  CHECK(bench.host.samples.size() == 20);
}

// APT16 p. 98: a keep-alive at least once a second, and before some 50 status messages
TEST_CASE("a servo controller is kept alive in silence and under many status messages") {
  StageBench bench = StageBench::prm();
  bench.arm_prm();
  bench.loop().run_for(0.9);
  CHECK(bench.link().take_written() == hex("92 04 00 00 50 01"));
  int without = 0;
  for (int i = 0; i < 100; ++i) {
    bench.receive_dc_status(i, idle_homed);
    without = bench.link().take_written().empty() ? without + 1 : 0;
    CHECK(without < 40);
  }
  StageBench stepper = StageBench::lts();
  stepper.arm_lts();
  for (int i = 0; i < 100; ++i) stepper.receive_status(i, idle_homed);
  stepper.loop().run_for(5);
  CHECK(stepper.link().take_written().empty());  // the protocol does not list it for LTS units
}

TEST_CASE("fault notices, with a text or without, fault the driver") {
  StageBench rich = StageBench::lts();
  rich.arm_lts();
  rich.receive(MessageId::hw_richresponse,
               apt::RichResponse{0, 17, apt::Text<64>::from("motor stalled")});
  CHECK(rich.fault_code() == Errc::device);
  CHECK(rich.host.faults[0].what.find("motor stalled") != std::string::npos);

  StageBench bare = StageBench::lts();
  bare.arm_lts();
  bare.receive(hex("80 00 00 00 01 50"));
  CHECK(bare.fault_code() == Errc::device);
}

TEST_CASE("a link that closes or refuses a write faults the driver") {
  StageBench closed = StageBench::lts();
  closed.arm_lts();
  closed.link().break_off();
  CHECK(closed.fault_code() == Errc::io);
  CHECK(closed.host.states.back() == DriverState::faulted);

  StageBench refusing = StageBench::lts();
  refusing.arm_lts();
  refusing.link().broken = true;
  CHECK_FALSE(refusing.driver->command(MoveCommand{0.01, 0.01}));
  CHECK(refusing.fault_code() == Errc::io);
  CHECK(refusing.loop().timers() == 0);
}

TEST_CASE("calls in the wrong state are refused with a sentence") {
  StageBench bench = StageBench::lts();
  CHECK(bench.driver->arm().error().code == Errc::wrong_state);
  CHECK(bench.driver->command(HomeCommand{}).error().code == Errc::wrong_state);
  REQUIRE(bench.driver->open());
  CHECK(bench.driver->open().error().code == Errc::wrong_state);
  bench.receive_info("LTS150");
  CHECK(bench.driver->command(PollCommand{}).error().code == Errc::wrong_state);
  const Status again = bench.driver->open();
  REQUIRE_FALSE(again);
  CHECK(again.error().code == Errc::wrong_state);
  CHECK(again.error().expected == "closed");
  CHECK(again.error().got == "open");
  REQUIRE(bench.driver->arm());
  bench.receive_status(0, idle_homed);
  CHECK(bench.driver->command(BiasCommand{}).error().code == Errc::unsupported);
  for (int i = 0; i < 2; ++i) bench.receive_status(0, idle_homed | 0x4000);
  CHECK(bench.driver->open().error().hint.find("Close") != std::string::npos);
}

TEST_CASE("closing stops the stage, leaves no timer, and the driver can be opened again") {
  StageBench bench = StageBench::lts(R"(, "poll_hz": 10)");
  bench.arm_lts();
  REQUIRE(bench.driver->command(MoveCommand{0.05, 0.01}));
  bench.link().take_written();
  bench.driver->close();
  CHECK(bench.link().take_written() == hex("65 04 01 01 50 01") + hex("12 00 00 00 50 01"));
  CHECK(bench.driver->state() == DriverState::closed);
  CHECK(bench.loop().timers() == 0);
  CHECK_FALSE(bench.link().listened_to());
  bench.driver->close();
  CHECK(bench.link().take_written().empty());
  bench.arm_lts();
  CHECK(bench.host.faults.empty());
}

TEST_CASE("a driver that is destroyed under way leaves no timer and no receiver behind") {
  StageBench bench = StageBench::prm(R"(, "poll_hz": 10)");
  bench.arm_prm();
  REQUIRE(bench.driver->command(HomeCommand{}));
  bench.check_gone_without_trace();
  bench.loop().run_for(200);
}

TEST_CASE("a fault while opening is closed and opened again") {
  StageBench bench = StageBench::lts();
  REQUIRE(bench.driver->open());
  bench.loop().run_for(2);
  CHECK(bench.fault_code() == Errc::timeout);
  bench.driver->close();
  bench.host.faults.clear();
  bench.arm_lts();
  CHECK(bench.host.faults.empty());
}

TEST_CASE("noise on the line neither confirms a motion nor makes samples, and is recovered from") {
  std::mt19937 random(11);
  StageBench bench = StageBench::lts();
  bench.arm_lts();
  REQUIRE(bench.driver->command(MoveCommand{0.05, 0.02}));
  for (int i = 0; i < 200; ++i) {
    Bytes noise(1 + random() % 100);
    for (std::uint8_t& b : noise) b = static_cast<std::uint8_t>(random());
    bench.receive(noise);
  }
  CHECK(bench.host.samples.empty());
  bench.receive(Bytes(300, 0));  // longer than any message length that noise can form
  bench.receive_completed(20480000);
  CHECK(bench.last_sample().move_id == 1);
  CHECK(bench.host.faults.empty());
}

TEST_CASE("soft limits inside the rig file's travel are refused, and wider ones stay") {
  for (const bool inside : {true, false}) {
    StageBench bench = StageBench::lts(R"(, "travel_mm": [0, 100])");
    REQUIRE(bench.driver->open());
    bench.receive_info("LTS150");
    const std::int32_t high = (inside ? 99 : 101) * 409600;
    bench.receive(MessageId::get_limswitchparams, apt::LimitSwitchParams{1, 2, 2, high, 0, 3});
    CHECK(bench.host.faults.size() == (inside ? 1U : 0U));
    if (inside) {
      CHECK(to_string(bench.host.faults[0]).find("/travel_mm") != std::string::npos);
      continue;
    }
    bench.link().take_written();
    REQUIRE(bench.driver->arm());
    Bytes saved;
    apt::append_message(saved, MessageId::set_limswitchparams,
                        apt::LimitSwitchParams{1, 2, 2, high, 0, 3}, {});
    const Bytes written = bench.link().take_written();
    CHECK(std::search(written.begin(), written.end(), saved.begin(), saved.end()) != written.end());
  }
}

TEST_CASE("a controller that keeps another speed or other switches is refused when arming") {
  for (const std::string saved : {"speed", "acceleration", "limit switches"}) {
    CAPTURE(saved);
    StageBench bench = StageBench::lts(R"(, "acceleration_mm_s2": 10)");
    REQUIRE(bench.driver->open());
    bench.receive_info("LTS150");
    REQUIRE(bench.driver->arm());
    constexpr std::int32_t at_20_mm_s = 20 * 21987328, at_10_mm_s2 = 10 * 4506;
    if (saved == "speed")
      bench.receive(MessageId::get_velparams, apt::VelocityParams{1, 0, at_10_mm_s2, 1000});
    else if (saved == "acceleration")
      bench.receive(MessageId::get_velparams,
                    apt::VelocityParams{1, 0, 2 * at_10_mm_s2, at_20_mm_s});
    else
      bench.receive(MessageId::get_limswitchparams, apt::LimitSwitchParams{1, 3, 2, 0, 0, 1});
    CHECK(bench.fault_code() == Errc::device_refused);
    CHECK_THAT(bench.host.faults[0].what, Catch::Contains(saved));
  }
}

TEST_CASE("a controller that rounds by a count, or by a millionth, is armed, not by more") {
  constexpr std::int32_t acceleration = 10 * 4506, speed = 20 * 21987328;
  const auto armed = [](std::int32_t acceleration_off, std::int32_t speed_off) {
    StageBench bench = StageBench::lts(R"(, "acceleration_mm_s2": 10)");
    REQUIRE(bench.driver->open());
    bench.receive_info("LTS150");
    REQUIRE(bench.driver->arm());
    bench.receive(MessageId::get_velparams,
                  apt::VelocityParams{1, 0, acceleration + acceleration_off, speed + speed_off});
    return bench.host.faults.empty();
  };
  for (const std::int32_t off : {-2, -1, 0, 1, 2}) CHECK(armed(off, 0) == (off * off <= 1));
  for (const std::int32_t off : {-450, -400, 0, 400, 450})
    CHECK(armed(0, off) == (off * off <= 439 * 439));
}

TEST_CASE("the front panel flashes when the configuration asks for it") {
  StageBench bench = StageBench::lts(R"(, "identify": true)");
  REQUIRE(bench.driver->open());
  const Bytes written = bench.link().take_written();
  CHECK(Bytes(written.end() - 6, written.end()) == hex("23 02 01 00 50 01"));
}

}  // namespace stage_lifecycle_test
