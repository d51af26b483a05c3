// The status of an emulated APT stage: the unsolicited messages, and their end.

#include <catch2/catch.hpp>
#include <numbers>
#include "tests/unit/sim/apt_unit.hpp"

namespace apt_stage_status_test {

using namespace weft;
using namespace weft::sim;
using namespace weft::protocols::apt;
using test::hex;
using test::Unit;

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
  CHECK(unit.bench_plant.stage(AxisId::rx).position(unit.now) ==
        Approx(std::numbers::pi / 2).epsilon(1e-5));
  unit.send("90 04 01 00 50 01");
  CHECK(decode(unit.take())->id == MessageId::get_dcstatusupdate);
  unit.send("80 04 01 00 50 01");
  CHECK(unit.take().empty());  // it is a stepper's request
  unit.send("11 00 00 00 50 01");
  unit.run(20);
  CHECK(unit.take().size() == 50 * 20);
  unit.send("92 04 00 00 50 01");
  unit.run(1.05);
  CHECK(unit.take().size() == 10 * 20);
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

TEST_CASE("of the steppers a BSC alone falls silent, which no acknowledgement ends") {
  for (const auto& [model, stage] : {std::pair{"BSC201", "NRT150"},
                                     {"LTS150", "LTS150"},
                                     {"K10CR1", "K10CR1"},
                                     {"SCC201", "NRT150"}}) {
    CAPTURE(model);
    Unit unit = Unit::at(model, stage);
    const bool bsc = std::string(stage) == "NRT150";
    unit.send("11 00 00 00 50 01");
    unit.run(6);
    CHECK(unit.take().size() == (bsc ? 50U : 60U) * 20);
    unit.send("92 04 00 00 50 01");
    unit.run(1);
    CHECK(unit.take().size() == (bsc ? 0U : 10U) * 20);
    unit.send("80 04 01 00 50 01");
    CHECK(decode(unit.take())->id == MessageId::get_statusupdate);
  }
}

TEST_CASE("the mode of the trigger is given back") {
  Unit unit = Unit::at("BSC201", "LTS150");
  unit.send("01 05 01 00 50 01");
  CHECK(unit.take() == hex("02 05 01 00 01 50"));
  unit.send("00 05 01 53 50 01 01 05 01 00 50 01");
  CHECK(unit.take() == hex("02 05 01 53 01 50"));
}

TEST_CASE(
    "what a host asked for ends with it: updates, silence about ends, the count of messages") {
  const auto ends_reported = [](Unit& unit) {
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
    CHECK(ends_reported(unit) == 20);
    unit.send("6B 04 00 00 50 01");
    CHECK(ends_reported(unit) == 0);
    next_host();
    CHECK(ends_reported(unit) == 20);
    unit.send("11 00 0A 00 50 01");
    unit.run(30);
    CHECK(ends_reported(unit) == 0);  // fifty messages have no acknowledgement
    next_host();
    CHECK(ends_reported(unit) == 20);
  }
}

TEST_CASE("a servo reports its speed in counts a servo cycle") {
  Unit unit("PRM1-Z8");
  unit.ready();
  const auto velocity = [&] {
    unit.take();
    unit.send("90 04 01 00 50 01");
    return decode_body<DcStatusUpdate>(decode(unit.take())->data).value().velocity_counts;
  };
  CHECK(velocity() == 0);
  const StageScale& scale = find_stage("PRM1-Z8")->scale;
  unit.send("57 04 01 02 50 01");  // on a KDC101 direction 2 increases the counts
  unit.run(3);
  const double deg_per_s =
      unit.bench_plant.stage(AxisId::rx).velocity(unit.now) * 180 / std::numbers::pi;
  REQUIRE(deg_per_s > 1);
  CHECK(velocity() == std::lround(deg_per_s * scale.velocity_counts / 65536));
  unit.send("65 04 01 01 50 01");
  unit.send("57 04 01 01 50 01");
  unit.run(3);
  CHECK(velocity() < 0);
}

TEST_CASE("the status shows direction and cause of motion from the first moment on") {
  Unit unit;
  const auto motion = [&] { return unit.status().status_bits & status::any_motion; };
  unit.send("43 04 01 00 50 01");
  CHECK(motion() == (status::homing | status::moving_reverse));
  unit.run(20);
  CHECK(motion() == 0);
  unit.send("43 04 01 00 50 01");  // on the switch: first off it, then back
  CHECK(motion() == (status::homing | status::moving_forward));
  unit.run(0.45);
  CHECK(motion() == (status::homing | status::moving_reverse));
  unit.run(2);
  const std::uint32_t forward = status::jogging_forward | status::moving_forward;
  const std::uint32_t reverse = status::jogging_reverse | status::moving_reverse;
  for (const bool back : {false, true}) {
    unit.send(back ? "6A 04 01 02 50 01" : "6A 04 01 01 50 01");
    CHECK(motion() == (back ? reverse : forward));
    unit.run(0.3);
    CHECK(motion() == (back ? reverse : forward));
    unit.run(3);
    CHECK(motion() == 0);
  }
  unit.send("53 04 06 00 D0 01 01 00 00 80 3E 00");
  CHECK(motion() == status::moving_forward);
  unit.run(5);
  unit.send("57 04 01 02 50 01");
  CHECK(motion() == status::moving_reverse);
  unit.run(0.1);
  unit.send("65 04 01 02 50 01");  // still in motion while it decelerates
  CHECK(motion() == status::moving_reverse);
}

TEST_CASE("a host that introduces itself receives updates and ends, also after other hosts") {
  for (const char* status_texts : {"05 00 00 00 50 01", "18 00 00 00 50 01", "11 00 00 00 50 01"}) {
    Unit unit("PRM1-Z8");
    unit.ready();
    unit.send("11 00 00 00 50 01");
    unit.run(10);  // the host leaves silently
    CHECK(unit.take().size() == 50 * 20);
    unit.send("53 04 06 00 D0 01 01 00 64 00 00 00");
    unit.run(2);
    CHECK(unit.take().empty());
    unit.send(status_texts);
    unit.send("12 00 00 00 50 01");
    unit.take();
    unit.send("53 04 06 00 D0 01 01 00 00 00 00 00");
    unit.run(2);
    CHECK(unit.take().size() == 20);
  }
}

}  // namespace apt_stage_status_test
