// Byte strings are those of reference protocols.md A.8; positions and times are the trapezoid's.

#include "sim/devices/apt_stage_emulator.hpp"

#include <catch2/catch.hpp>
#include <numbers>

#include "sim/plant/random.hpp"
#include "tests/unit/sim/support.hpp"

using namespace weft;
using namespace weft::sim;
using namespace weft::protocols::apt;
using test::hex;

namespace {

WorldParams world_params() {
  WorldParams params;
  for (StageParams& stage : params.stages)
    stage = {.low = 0, .high = 0.15, .start = 0.02, .quantum = 0, .backlash = 0};
  params.stages[3] = {.low = -3.2, .high = 3.2, .start = 0.1, .quantum = 0, .backlash = 0};
  params.plant.geometry.plate_z_m = 0.1;
  return params;
}

/// One stage on a bench of its own.
struct Unit {
  explicit Unit(const std::string& stage = "LTS150",
                RetargetPolicy retarget = RetargetPolicy::replan)
      : world(world_params(), 1), emulator(params(stage, retarget), world, {}) {}

  static AptStageParams params(const std::string& stage, RetargetPolicy retarget) {
    AptStageParams p;
    p.stage = find_stage(stage);
    p.axis = p.stage->axis == Axis::linear ? AxisId::x : AxisId::rx;
    p.model = p.stage->axis == Axis::linear ? "LTS150" : "KDC101";
    p.retarget = retarget;
    return p;
  }
  void send(const Bytes& bytes) { emulator.receive(bytes, now, sink); }
  void send(const std::string& text) { send(hex(text)); }
  /// Lets time pass, calling the emulator when it asks for it.
  void run(double seconds) {
    const TimePoint end = now + from_seconds(seconds);
    for (auto at = emulator.next_wakeup(); at && *at <= end; at = emulator.next_wakeup())
      emulator.wake(now = *at, sink);
    now = end;
  }
  Bytes take() { return std::exchange(out, {}); }
  StatusUpdate status() {
    take();
    send("80 04 01 00 50 01");
    return decode_body<StatusUpdate>(decode(take())->data).value();
  }
  void ready() {
    send("10 02 01 01 50 01");
    send("43 04 01 00 50 01");
    run(20);
    take();
  }
  double position() { return world.stage(AxisId::x).position(now); }

  Bytes out;
  ByteSink sink = [this](ByteView bytes) { out.insert(out.end(), bytes.begin(), bytes.end()); };
  TimePoint now{};
  BenchWorld world;
  AptStageEmulator emulator;
};

}  // namespace

TEST_CASE("a stage tells its identity in 90 bytes and is silent otherwise") {
  Unit unit;
  unit.run(5);
  CHECK(unit.out.empty());
  unit.send("05 00 00 00 50 01");
  const Bytes reply = unit.take();
  REQUIRE(reply.size() == 90);
  CHECK(Bytes(reply.begin(), reply.begin() + 6) == hex("06 00 54 00 81 50"));
  const auto info = decode_body<HardwareInfo>(decode(reply)->data);
  CHECK(info->model.str() == "LTS150");
  CHECK(info->serial == 45000001);
  CHECK(Unit("PRM1-Z8").emulator.ignored() == 0);
}

TEST_CASE("homing drives to zero at the home speed and then says so") {
  Unit unit;
  unit.send("10 02 01 02 50 01 43 04 01 00 50 01");
  unit.run(1);
  CHECK(unit.out.empty());
  CHECK(unit.position() == Approx(0.02));  // disabled: nothing moves
  unit.send("10 02 01 01 50 01");
  unit.send("40 04 0E 00 D0 01 01 00 02 00 01 00 00 00 9F 02 00 20 03 00");  // 2 mm/s
  unit.send("13 04 0E 00 D0 01 01 00 00 00 00 00 08 60 01 00 00 00 36 1A");  // 20, 20
  unit.send("43 04 01 00 50 01");
  CHECK(unit.status().status_bits == 0x80000300);
  unit.run(9.9);
  CHECK(unit.take().empty());
  unit.run(0.3);
  CHECK(unit.take() == hex("44 04 01 00 01 50"));  // 20 mm at 2 mm/s and 0.1 s of ramps
  CHECK(unit.status().status_bits == 0x80000500);
  CHECK(unit.status().position_counts == 0);
}

TEST_CASE("an absolute move ends with the documented message after the trapezoid's time") {
  Unit unit;
  unit.ready();
  unit.send("13 04 0E 00 D0 01 01 00 00 00 00 00 08 60 01 00 00 00 36 1A");  // 20 mm/s, 20 mm/s2
  unit.send("53 04 06 00 D0 01 01 00 00 C0 D4 01");                          // 75 mm
  unit.run(4.7);
  CHECK(unit.status().status_bits == 0x80000510);
  CHECK(unit.position() == Approx(0.075).margin(1e-3));
  CHECK(unit.take().empty());
  unit.run(0.06);
  CHECK(unit.take() == hex("64 04 0E 00 81 50 01 00 00 C0 D4 01 00 00 00 00 00 05 00 80"));
}

TEST_CASE("a bow index makes the move an S-curve, which lasts longer by acceleration over jerk") {
  Unit unit;
  unit.ready();
  unit.send("13 04 0E 00 D0 01 01 00 00 00 00 00 08 60 01 00 00 00 36 1A");  // 20 mm/s, 20 mm/s2
  unit.send("F4 04 04 00 D0 01 01 00 07 00");                                // 64 mm/s3
  unit.send("53 04 06 00 D0 01 01 00 00 C0 D4 01");                          // 75 mm
  unit.run(4.75 + 20.0 / 64 - 0.01);
  CHECK(unit.take().empty());
  unit.run(0.02);
  CHECK(unit.take() == hex("64 04 0E 00 81 50 01 00 00 C0 D4 01 00 00 00 00 00 05 00 80"));
  unit.send("F4 04 04 00 D0 01 01 00 FF FF");  // beyond the last index: as the last
  unit.send("53 04 06 00 D0 01 01 00 00 00 00 00");
  unit.run(4.75 + 20.0 / 131072 + 1e-3);
  CHECK(unit.take().size() == 20);
}

TEST_CASE("a moving stage reports as the reference computes it") {
  Unit unit;
  unit.ready();
  unit.send("53 04 06 00 D0 01 01 00 00 C0 D4 01");
  while (unit.position() < 0.01) unit.run(1e-4);
  const StatusUpdate status = unit.status();
  CHECK(status.status_bits == 0x80000510);
  CHECK(status.position_counts == Approx(4096000).margin(1000));
}

TEST_CASE("relative moves, stored parameters and their requests agree") {
  Unit unit;
  unit.ready();
  unit.send("45 04 06 00 D0 01 01 00 00 80 3E 00");  // store 10 mm
  unit.send("46 04 01 00 50 01");
  CHECK(unit.take() == hex("47 04 06 00 81 50 01 00 00 80 3E 00"));
  unit.send("48 04 01 00 50 01");  // short form uses it
  unit.run(5);
  unit.send("48 04 06 00 D0 01 01 00 00 80 3E 00");  // long form
  unit.run(5);
  CHECK(unit.status().position_counts == 8192000);
  unit.send("50 04 06 00 D0 01 01 00 00 80 3E 00");
  unit.send("53 04 01 00 50 01");  // short form of absolute: back to 10 mm
  unit.run(5);
  CHECK(unit.status().position_counts == 4096000);
  unit.send("11 04 01 00 50 01");
  CHECK(unit.take() == hex("12 04 06 00 81 50 01 00 00 80 3E 00"));
}

TEST_CASE("a new target during a move is followed at once, and only its end is reported") {
  Unit unit;
  unit.ready();
  unit.send("53 04 06 00 D0 01 01 00 00 C0 D4 01");
  unit.run(1);
  const double there = unit.position();
  unit.send("53 04 06 00 D0 01 01 00 00 80 3E 00");  // 10 mm
  CHECK(unit.position() == Approx(there).margin(1e-12));
  unit.run(20);
  const Bytes end = unit.take();
  CHECK(end.size() == 20);
  CHECK(unit.status().position_counts == 4096000);
  Unit stubborn("LTS150", RetargetPolicy::ignore);
  stubborn.ready();
  stubborn.send("53 04 06 00 D0 01 01 00 00 C0 D4 01");
  stubborn.run(1);
  stubborn.send("53 04 06 00 D0 01 01 00 00 80 3E 00");
  stubborn.run(20);
  CHECK(stubborn.status().position_counts == 30720000);
}

TEST_CASE("stopping is immediate or profiled, and answered with where it ended") {
  for (const bool profiled : {false, true}) {
    Unit unit;
    unit.ready();
    unit.send("53 04 06 00 D0 01 01 00 00 C0 D4 01");
    unit.run(2);
    const double there = unit.position();
    unit.send(profiled ? "65 04 01 02 50 01" : "65 04 01 01 50 01");
    if (profiled) CHECK(unit.take().empty());
    unit.run(3);
    const auto message = decode(unit.take());
    REQUIRE(message.has_value());
    CHECK(message->id == MessageId::move_stopped);
    const double ran_on = unit.position() - there;
    CHECK(ran_on == Approx(profiled ? 0.02 * 0.02 / (2 * 0.02) : 0).margin(1e-9));
    CHECK(unit.status().status_bits == 0x80000500);
  }
}

TEST_CASE("targets beyond the travel end at its limit, with the limit bit") {
  Unit unit;
  unit.ready();
  unit.send("53 04 06 00 D0 01 01 00 FF FF FF 7F");
  unit.run(60);
  CHECK(unit.position() == 0.15);
  CHECK(unit.status().status_bits == 0x80000501);
}

TEST_CASE("updates come ten times a second between start and stop") {
  Unit unit;
  unit.send("11 00 00 00 50 01");
  unit.run(2.05);
  CHECK(unit.take().size() == 20 * 20);
  unit.send("12 00 00 00 50 01");
  unit.run(2);
  CHECK(unit.take().empty());
}

TEST_CASE("a servo answers with its own status and falls silent without acknowledgements") {
  Unit unit("PRM1-Z8");
  unit.send("10 02 01 01 50 01");
  unit.send("43 04 01 00 50 01");
  unit.run(5);
  CHECK(unit.take() == hex("44 04 01 00 01 50"));
  unit.send("13 04 0E 00 D0 01 01 00 00 00 00 00 93 00 00 00 69 8D 06 00");  // 10 deg/s, 10 deg/s2
  unit.send("53 04 06 00 D0 01 01 00 E0 A2 02 00");                          // 90 degrees
  unit.run(11);
  CHECK(unit.take() == hex("64 04 0E 00 81 50 01 00 E0 A2 02 00 00 00 00 00 00 05 00 80"));
  CHECK(unit.world.stage(AxisId::rx).position(unit.now) ==
        Approx(std::numbers::pi / 2).epsilon(1e-5));
  unit.send("90 04 01 00 50 01");
  CHECK(decode(unit.take())->id == MessageId::get_dcstatusupdate);
  unit.send("80 04 01 00 50 01");
  CHECK(unit.take().empty());  // a stepper's request
  unit.send("11 00 00 00 50 01");
  unit.run(20);
  CHECK(unit.take().size() == 50 * 20);
  unit.send("92 04 00 00 50 01");
  unit.run(1.05);
  CHECK(unit.take().size() == 10 * 20);
}

TEST_CASE("any chunking of a conversation has the same effect") {
  const std::string conversation =
      "18 00 00 00 50 01 12 00 00 00 50 01 05 00 00 00 50 01 10 02 01 01 50 01 "
      "43 04 01 00 50 01 13 04 0E 00 D0 01 01 00 00 00 00 00 08 60 01 00 00 00 36 1A "
      "53 04 06 00 D0 01 01 00 00 C0 D4 01 80 04 01 00 50 01 14 04 01 00 50 01";
  Unit whole;
  whole.send(conversation);
  const Bytes expected = whole.take();
  REQUIRE(expected.size() == 90 + 20 + 20);
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    Random random(seed);
    Unit cut;
    const Bytes bytes = hex(conversation);
    for (std::size_t at = 0; at < bytes.size();) {
      const std::size_t size = std::min<std::size_t>(1 + random.bits() % 9, bytes.size() - at);
      cut.send(Bytes(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                     bytes.begin() + static_cast<std::ptrdiff_t>(at + size)));
      at += size;
    }
    CHECK(cut.take() == expected);
  }
}

TEST_CASE("a unit with one channel answers at every address that hosts use, from there") {
  Unit unit;
  for (const char* address : {"50", "21", "11"}) {
    unit.send(std::string("05 00 00 00 ") + address + " 01");
    const Bytes reply = unit.take();
    REQUIRE(reply.size() == 90);
    CHECK(Bytes(reply.begin(), reply.begin() + 6) == hex(std::string("06 00 54 00 81 ") + address));
  }
  unit.send("60 00 00 00 11 01 60 00 01 00 11 01");
  CHECK(unit.take() == hex("61 00 00 01 01 11 61 00 01 02 01 11"));
}

TEST_CASE("a card answers at its bay, its rack at 0x11 with the rack's own info") {
  AptStageParams params = Unit::params("NRT150", RetargetPolicy::replan);
  params.model = "BSC203";
  params.bay = 1;
  BenchWorld world(world_params(), 1);
  AptStageEmulator card(params, world, {});
  Bytes out;
  ByteSink sink = [&](ByteView bytes) { out.insert(out.end(), bytes.begin(), bytes.end()); };
  const auto ask = [&](const std::string& text) {
    out.clear();
    card.receive(hex(text), {}, sink);
    return out;
  };
  const auto info = [&](const std::string& text) {
    return decode_body<HardwareInfo>(decode(ask(text))->data).value();
  };
  CHECK(info("05 00 00 00 11 01").hardware_type == 45);
  CHECK(info("05 00 00 00 11 01").channels == 3);
  CHECK(info("05 00 00 00 22 01").hardware_type == 44);
  CHECK(info("05 00 00 00 22 01").channels == 1);
  CHECK(ask("05 00 00 00 50 01").empty());
  CHECK(ask("05 00 00 00 21 01").empty());
  CHECK(ask("60 00 01 00 11 01") == hex("61 00 01 01 01 11"));
  CHECK(ask("60 00 00 00 11 01") == hex("61 00 00 02 01 11"));
  CHECK(ask("11 04 01 00 22 01") == hex("12 04 06 00 81 22 01 00 00 00 00 00"));
}

TEST_CASE("every parameter that is set is given back, and the database's defaults before") {
  Unit unit;
  unit.send("3B 04 01 00 50 01");  // backlash 0.05 mm
  CHECK(unit.take() == hex("3C 04 06 00 81 50 01 00 00 50 00 00"));
  unit.send("41 04 01 00 50 01");  // homing 2 mm/s, offset 0.5 mm
  CHECK(unit.take() == hex("42 04 0E 00 81 50 01 00 02 00 01 00 00 00 9F 02 00 20 03 00"));
  for (const auto& [set, size] : {std::pair{0x0413, 14},
                                  {0x0416, 22},
                                  {0x0423, 16},
                                  {0x0426, 6},
                                  {0x043A, 6},
                                  {0x0440, 14},
                                  {0x0445, 6},
                                  {0x0450, 6},
                                  {0x04A0, 20},
                                  {0x04B3, 4},
                                  {0x04F4, 4},
                                  {0x0523, 12},
                                  {0x0526, 34}}) {
    Message message{
        static_cast<MessageId>(set), 0, 0, 0x50, 0x01, Bytes(static_cast<std::size_t>(size), 7)};
    unit.send(encode(message));
    CHECK(unit.take().empty());
    unit.send(encode(Message{static_cast<MessageId>(set + 1), 1, 0, 0x50, 0x01, {}}));
    const auto reply = decode(unit.take());
    REQUIRE(reply);
    CHECK(reply->id == static_cast<MessageId>(set + 2));
    CHECK(reply->data == message.data);
  }
  CHECK(unit.emulator.ignored() == 0);
}

TEST_CASE("a stage at home runs off its switch and homes again, so that homing always moves") {
  Unit unit;
  unit.ready();
  unit.send("43 04 01 00 50 01");
  unit.run(0.2);
  CHECK(unit.status().position_counts > 0);
  unit.run(2);
  CHECK(unit.take() == hex("44 04 01 00 01 50"));
  CHECK(unit.status().position_counts == 0);
}

TEST_CASE("soft limits hold and show in the status when their mode says so") {
  Unit unit;
  unit.ready();
  unit.send("23 04 10 00 D0 01 01 00 02 00 02 00 00 80 3E 00 00 00 00 00 03 00");  // 10 mm
  unit.send("53 04 06 00 D0 01 01 00 00 C0 D4 01");
  unit.run(10);
  CHECK(unit.status().position_counts == 4096000);
  CHECK(unit.status().status_bits == 0x80000504);
}

TEST_CASE("a servo without acknowledgements keeps the ends of moves to itself, an LTS does not") {
  for (const bool servo : {true, false}) {
    Unit unit(servo ? "PRM1-Z8" : "LTS150");
    unit.ready();
    unit.send("11 00 00 00 50 01");
    unit.run(6);
    CHECK(unit.take().size() == (servo ? 50U : 60U) * 20);
    unit.send("53 04 06 00 D0 01 01 00 E8 03 00 00");
    unit.run(0.09);
    CHECK(unit.take().empty() == servo);
  }
}

TEST_CASE("noise on the line and messages for others do no harm") {
  Unit unit;
  Random random(3);
  for (int i = 0; i < 3000; ++i) {
    Bytes noise(1 + random.bits() % 64);
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(random.bits());
    // Half of it wears a header that is believed.
    if (i % 2 == 0 && noise.size() > 6) {
      noise[1] = static_cast<std::uint8_t>(random.bits() % 6);
      noise[3] = 0;
      noise[4] = random.bits() % 2 == 0 ? 0x50 : 0xD0;
      noise[5] = 0x01;
    }
    unit.send(noise);
    unit.run(0.01);
  }
  unit.send(Bytes(600, 0));
  unit.take();
  CHECK(unit.position() >= 0);
  CHECK(unit.position() <= 0.15);
  unit.send("05 00 00 00 22 01");  // bay 1 is somebody else
  CHECK(unit.take().empty());
  CHECK(unit.emulator.ignored() > 0);
}

TEST_CASE("half a message of a host that went is not the beginning of another's") {
  Unit unit;
  unit.ready();
  unit.send("53 04 06 00 D0 01 01 00");  // four bytes of a position are missing
  unit.run(1);
  unit.send("05 00 00 00 50 01");
  CHECK(unit.take().size() == 90);
  unit.run(5);
  CHECK(unit.position() == Approx(0).margin(1e-9));  // and nothing was driven
  unit.send("53 04 06 00 D0 01 01 00");
  unit.run(0.1);
  unit.send("00 C0 D4 01");  // a slow host's rest
  unit.run(20);
  CHECK(unit.take().size() == 20);
  // on TCP the rig knows at once
  unit.send("53 04 06 00 D0 01 01 00");
  unit.emulator.meet_new_host();
  unit.send("05 00 00 00 50 01");
  CHECK(unit.take().size() == 90);
}

TEST_CASE(
    "what a host asked for ends with it: updates, silence about ends, the count of messages") {
  const auto ends_told = [](Unit& unit) {
    unit.take();
    unit.send("48 04 06 00 D0 01 01 00 64 00 00 00");
    unit.run(3);
    return unit.take().size();
  };
  for (const bool says_goodbye : {true, false}) {
    Unit unit("PRM1-Z8");
    unit.ready();
    const auto next_host = [&] {
      if (says_goodbye)
        unit.send("02 00 00 00 50 01");
      else
        unit.emulator.meet_new_host();
      unit.take();
    };
    CHECK(ends_told(unit) == 20);
    unit.send("6B 04 00 00 50 01");
    CHECK(ends_told(unit) == 0);
    next_host();
    CHECK(ends_told(unit) == 20);
    unit.send("11 00 0A 00 50 01");
    unit.run(30);
    CHECK(ends_told(unit) == 0);  // nobody has acknowledged fifty messages
    next_host();
    CHECK(ends_told(unit) == 20);
  }
}

TEST_CASE("a servo tells its speed in counts a servo cycle") {
  Unit unit("PRM1-Z8");
  unit.ready();
  const auto velocity = [&] {
    unit.take();
    unit.send("90 04 01 00 50 01");
    return decode_body<DcStatusUpdate>(decode(unit.take())->data).value().velocity_counts;
  };
  CHECK(velocity() == 0);
  const StageScale& scale = find_stage("PRM1-Z8")->scale;
  unit.send("57 04 01 01 50 01");
  unit.run(3);
  const double deg_per_s = unit.world.stage(AxisId::rx).velocity(unit.now) * 180 / std::numbers::pi;
  REQUIRE(deg_per_s > 1);
  CHECK(velocity() == std::lround(deg_per_s * scale.velocity_counts / 65536));
  unit.send("65 04 01 01 50 01");
  unit.send("57 04 01 02 50 01");
  unit.run(3);
  CHECK(velocity() < 0);
}

TEST_CASE("a velocity move ends at the switch of its direction") {
  Unit unit;
  unit.ready();
  const auto limits = [&] { return unit.status().status_bits & status::any_limit; };
  CHECK(limits() == 0);  // home, not driven into the switch
  unit.send("57 04 01 02 50 01");
  unit.run(20);
  CHECK(limits() == status::reverse_limit);
  unit.send("57 04 01 01 50 01");
  CHECK(limits() == 0);
  unit.run(120);
  CHECK(limits() == status::forward_limit);
}
