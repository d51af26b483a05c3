#include "sim/plant/scene/scene.hpp"

#include <catch2/catch.hpp>

namespace scene_test {

using namespace weft;
using namespace weft::sim;

TEST_CASE("The least level follows from what a scene asks for") {
  const auto least = [](std::vector<Channel> channels, std::vector<Trait> traits = {}) {
    return least_level({"test", std::move(channels), std::move(traits)});
  };
  CHECK(least({Channel::imprint}) == Level::z);
  CHECK(least({Channel::imprint}, {Trait::neighbour_load}) == Level::z_plus);
  CHECK(least({Channel::taxels, Channel::wrench}, {Trait::mean_level}) == Level::algebraic);
  CHECK(least({Channel::taxels}, {Trait::relaxation}) == Level::quasistatic);
  CHECK(least({Channel::taxels}, {Trait::regulated_force}) == Level::quasistatic);
  CHECK(least({Channel::wrench}, {Trait::stick_slip}) == Level::dynamic);
  CHECK(least({Channel::wrench}, {Trait::overshoot}) == Level::dynamic);
  CHECK(least({Channel::accelerometer}) == Level::modal);
  CHECK(least({Channel::microphone, Channel::taxels}) == Level::modal);
}

TEST_CASE("A channel that the level cannot produce is refused with a sentence") {
  const Scene scene{"vibrotactile", {Channel::stages, Channel::microphone}, {}};
  const Status refused = check(scene, Level::quasistatic);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::unsupported);
  CHECK(refused.error().where == "scene vibrotactile");
  CHECK(refused.error().what.find("sound") != std::string::npos);
  CHECK(refused.error().expected == "L3 or above");
  CHECK(refused.error().got == "L1");
  CHECK(check(scene, Level::modal));
}

TEST_CASE("No level moves a sensor and takes a static imprint") {
  const auto none = least_level({"both", {Channel::imprint, Channel::taxels}, {}});
  REQUIRE_FALSE(none);
  CHECK(none.error().code == Errc::unsupported);
}

TEST_CASE("Levels have names that read back") {
  for (const Level level : all_levels) CHECK(level_from(to_string(level)) == level);
  CHECK_FALSE(level_from("L4"));
}

TEST_CASE("Traits have names that read back") {
  for (const Trait trait : all_traits) CHECK(trait_from(name_of(trait)) == trait);
  const auto none = trait_from("stickslip");
  REQUIRE_FALSE(none);
  CHECK(none.error().expected.find("stick_slip") != std::string::npos);
}

TEST_CASE("A scene lists its needs in words") {
  CHECK(format_needs({"test", {Channel::stages}, {}}) == "stage positions");
  CHECK(format_needs({"test", {Channel::stages, Channel::wrench}, {}}) == "a wrench");
  CHECK(format_needs({"test",
                      {Channel::stages, Channel::taxels, Channel::wrench},
                      {Trait::regulated_force}}) == "taxel counts, a wrench and a regulated force");
}

}  // namespace scene_test
