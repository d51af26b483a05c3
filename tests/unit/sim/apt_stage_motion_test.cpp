// Motions of an emulated APT stage, and its messages at their ends.

#include <catch2/catch.hpp>

#include "tests/unit/sim/apt_unit.hpp"

namespace apt_stage_motion_test {

using namespace weft;
using namespace weft::sim;
using namespace weft::protocols::apt;
using test::hex;
using test::Unit;

TEST_CASE("homing drives to zero at the home speed and then reports it") {
  Unit unit;
  unit.send("10 02 01 02 50 01 43 04 01 00 50 01");
  unit.run(1);
  CHECK(unit.out.empty());
  CHECK(unit.position() == Approx(0.02));  // disabled: no motion
  unit.send("10 02 01 01 50 01");
  unit.send("40 04 0E 00 D0 01 01 00 02 00 01 00 00 00 9F 02 00 20 03 00");  // 2 mm/s
  unit.send("13 04 0E 00 D0 01 01 00 00 00 00 00 08 60 01 00 00 00 36 1A");  // 20, 20
  unit.send("43 04 01 00 50 01");
  CHECK(unit.status().status_bits == 0x80000320);
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
  unit.send("F4 04 04 00 D0 01 01 00 FF FF");  // beyond the last index: as the last one
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
  unit.send("48 04 01 00 50 01");  // the short form uses it
  unit.run(5);
  unit.send("48 04 06 00 D0 01 01 00 00 80 3E 00");  // the long form
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
  unit.send("53 04 06 00 D0 01 01 00 00 00 00 80");
  unit.run(60);
  CHECK(unit.position() == 0);
  CHECK(unit.status().status_bits == 0x80000502);
  unit.send("53 04 06 00 D0 01 01 00 00 00 00 00");  // the present position: not driven into the
                                                     // switch
  unit.run(1);
  CHECK(unit.status().status_bits == 0x80000500);
}

TEST_CASE("homing forwards ends the offset before the other end, which is zero then") {
  Unit unit;
  unit.send("40 04 0E 00 D0 01 01 00 01 00 04 00 00 00 A0 02 00 20 03 00");  // 2 mm/s, 0.5 mm
  unit.send("43 04 01 00 50 01");
  unit.run(120);
  CHECK(unit.take() == hex("44 04 01 00 01 50"));
  CHECK(unit.position() == Approx(0.1495));
  CHECK(unit.status().position_counts == 0);
  unit.send("43 04 01 00 50 01");  // off the switch and back
  unit.run(0.3);
  CHECK(unit.position() < 0.1495);
  unit.run(5);
  CHECK(unit.position() == Approx(0.1495));
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

TEST_CASE("soft limits hold and show in the status when their mode is active") {
  Unit unit;
  unit.ready();
  unit.send("23 04 10 00 D0 01 01 00 02 00 02 00 00 80 3E 00 00 00 00 00 03 00");  // 10 mm
  unit.send("53 04 06 00 D0 01 01 00 00 C0 D4 01");
  unit.run(10);
  CHECK(unit.status().position_counts == 4096000);
  CHECK(unit.status().status_bits == 0x80000504);
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

}  // namespace apt_stage_motion_test
