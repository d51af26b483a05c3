// Differences between controllers: the direction of velocity moves and jogs, the listed counters
// and parameters, and the status of the brushless family.

#include "tests/unit/sim/apt_unit.hpp"

namespace apt_controllers_test {

using namespace weft;
using namespace weft::sim;
using namespace weft::sim::test;

namespace {

/// A unit with this controller, homed and enabled, 5 mm or degrees from home.
Unit away_from_home(const std::string& controller, const std::string& stage,
                    std::uint8_t positive_direction = 0) {
  AptStageParams params = Unit::params(stage, RetargetPolicy::replan);
  params.model = controller;
  params.positive_direction = positive_direction;
  return Unit(params);
}

std::int32_t position_counter(Unit& unit) {
  unit.take();
  unit.send("11 04 01 00 50 01");
  return decode_body<protocols::apt::ChannelCounts>(decode(unit.take())->data).value().value_counts;
}

}  // namespace

// pylablib, pyKDC101 and thorlabs-apt-device, tested on hardware, use direction 2 for increasing
// counts on KDC and TDC
TEST_CASE("the direction that increases the counts is the controller's, or the rig file's") {
  struct Case {
    const char* controller;
    const char* stage;
    std::uint8_t given;
    int rising;
  };
  for (const Case& c : {Case{"KDC101", "PRM1-Z8", 0, 2},
                        {"TDC001", "PRM1-Z8", 0, 2},
                        {"KDC101", "PRM1-Z8", 1, 1},
                        {"LTS150", "LTS150", 0, 1},
                        {"BSC201", "NRT150", 0, 1},
                        {"KBD101", "DDS220", 0, 1},
                        {"LTS150", "LTS150", 2, 2}})
    for (const char* message : {"57 04", "6A 04"})
      for (const int direction : {1, 2}) {
        INFO(c.controller << " " << message << " direction " << direction);
        Unit unit = away_from_home(c.controller, c.stage, c.given);
        const std::int32_t before = position_counter(unit);
        unit.send(std::string(message) + (direction == 1 ? " 01 01 50 01" : " 01 02 50 01"));
        unit.run(0.5);
        const std::int32_t after = position_counter(unit);
        REQUIRE(after != before);
        CHECK((after > before) == (direction == c.rising));
      }
}

TEST_CASE("an encoder count has one answer, and none from a controller that does not list it") {
  Unit lts = Unit::at("LTS150", "LTS150"), card = Unit::at("SCC201", "LTS150");
  for (Unit* unit : {&lts, &card}) {
    unit->send("57 04 01 01 50 01");
    unit->run(1);
  }
  lts.take();
  lts.send("0A 04 01 00 50 01");
  CHECK(lts.take().empty());
  CHECK(lts.status().encoder_counts == 0);
  lts.send("09 04 06 00 D0 01 01 00 07 00 00 00");  // it cannot be set either
  CHECK(lts.status().encoder_counts == 0);

  const auto encoder_counter = [&] {
    card.take();
    card.send("0A 04 01 00 50 01");
    return decode_body<protocols::apt::ChannelCounts>(decode(card.take())->data)
        .value()
        .value_counts;
  };
  CHECK(encoder_counter() == 0);  // no encoder is fitted
  CHECK(card.status().encoder_counts == 0);
  card.send("09 04 06 00 D0 01 01 00 07 00 00 00");
  CHECK(encoder_counter() == 7);
  CHECK(card.status().encoder_counts == 7);

  AptStageParams params = Unit::params("LTS150", RetargetPolicy::replan);
  params.model = "SCC201";
  params.encoder = true;
  Unit fitted(params);
  fitted.send("57 04 01 01 50 01");
  fitted.run(1);
  fitted.send("65 04 01 01 50 01");
  const std::int32_t status = fitted.status().encoder_counts;
  CHECK(status > 400000);
  fitted.send("0A 04 01 00 50 01");
  CHECK(decode_body<protocols::apt::ChannelCounts>(decode(fitted.take())->data)
            .value()
            .value_counts == status);
}

TEST_CASE("an LTS neither answers nor takes parameters that it does not list") {
  Unit unit;
  for (const char* request : {"0A 04", "27 04", "A1 04", "B1 04", "B4 04", "21 05", "24 05",
                              "27 05", "2A 05", "01 05", "90 04"}) {
    INFO(request);
    unit.send(std::string(request) + " 01 00 50 01");
    CHECK(unit.take().empty());
  }
  unit.send("14 04 01 00 50 01");
  CHECK_FALSE(unit.take().empty());
}

TEST_CASE("a brushless drive reports position, velocity per T and status in 0491") {
  Unit unit = Unit::at("KBD101", "DDS220");
  unit.send("10 02 01 01 50 01");
  // 100 mm/s, 500 mm/s2
  unit.send("13 04 0E 00 D0 01 01 00 00 00 00 00 D8 1A 00 00 CD CC CC 00");
  unit.send("53 04 06 00 D0 01 01 00 C0 27 09 00");  // 600000 counts, 30 mm
  unit.run(0.25);                                    // at full speed after 0.2 s: 10 mm + 5 mm
  unit.send("90 04 01 00 50 01");
  const auto moving = decode_body<DcStatusUpdate>(decode(unit.take())->data).value();
  CHECK(moving.position_counts == Approx(300000).margin(200));
  CHECK(moving.velocity_counts == 205);  // 20000 x 102.4e-6 x 100, APT16's example
  unit.run(2);
  CHECK(position_counter(unit) == 600000);
}

TEST_CASE("a stage counts as its controller does") {
  for (const auto& [controller, counts] : {std::pair{"SCC201", 409600}, {"BSC101", 25600}}) {
    AptStageParams params = Unit::params("NRT150", RetargetPolicy::replan);
    params.model = controller;
    params.stage = find_stage("NRT150", controller);
    Unit unit(params);
    Bytes move;
    append_message(move, protocols::apt::MessageId::move_absolute,
                   protocols::apt::ChannelCounts{1, counts}, {0x50, 0x01});
    const double before = unit.position();
    unit.send(move);
    unit.run(5);
    CHECK(unit.position() - before == Approx(1e-3).margin(1e-9));
  }
}

}  // namespace apt_controllers_test
