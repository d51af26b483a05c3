#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>

#include "drivers/api/config.hpp"
#include "drivers/api/driver_base.hpp"
#include "drivers/api/timer.hpp"
#include "drivers/ati_netft/netft_driver.hpp"
#include "drivers/taxel_array/taxel_driver.hpp"
#include "drivers/thorlabs_apt/stage_driver.hpp"
#include "drivers/vibro/vibro_driver.hpp"
#include "protocols/apt/stage_scale.hpp"
#include "tests/unit/drivers/fakes.hpp"

namespace config_test {

using namespace weft;
using namespace weft::testing;
using drivers::ati_netft_entry;
using drivers::taxel_array_entry;
using drivers::thorlabs_apt_entry;

namespace {
const DriverEntry* const entries[] = {&thorlabs_apt_entry, &ati_netft_entry, &taxel_array_entry,
                                      &drivers::vibro_entry};

Error refusal(const DriverEntry& entry, const std::string& config) {
  FakeHost host;
  const auto made = entry.create(config, host);
  REQUIRE_FALSE(made);
  return made.error();
}
}  // namespace

TEST_CASE("every driver's entry names itself and makes a closed driver from defaults") {
  for (const DriverEntry* entry : entries) {
    INFO(entry->name);
    CHECK_FALSE(std::string(entry->summary).empty());
    FakeHost host;
    const auto made = entry->create("{}", host);
    REQUIRE(made);
    CHECK((*made)->state() == DriverState::closed);
    CHECK(host.loop_.timers() == 0);
  }
}

TEST_CASE("what a driver's schema lists with a default, the driver takes") {
  for (const DriverEntry* entry : entries) {
    const auto schema = nlohmann::json::parse(entry->config_schema_json);
    CHECK(schema.at("additionalProperties") == false);
    for (const auto& [key, property] : schema.at("properties").items()) {
      INFO(entry->name << " " << key);
      if (!property.contains("default")) continue;
      FakeHost host;
      CHECK(entry->create(nlohmann::json{{key, property.at("default")}}.dump(), host));
    }
  }
}

TEST_CASE("the stage schema lists the stages of the table") {
  const auto schema = nlohmann::json::parse(thorlabs_apt_entry.config_schema_json);
  std::vector<std::string> names;
  for (const auto& model : protocols::apt::stage_models()) names.emplace_back(model.name);
  CHECK(schema.at("properties").at("stage").at("enum").get<std::vector<std::string>>() == names);
}

TEST_CASE("an unknown key is refused with the key that was probably meant") {
  const Error speed = refusal(thorlabs_apt_entry, R"({"max_speed_m_s": 4})");
  CHECK(speed.where == "/max_speed_m_s");
  CHECK(speed.hint.find("max_speed_mm_s") != std::string::npos);
  // a key in degrees belongs to rotary stages only
  const Error travel = refusal(thorlabs_apt_entry, R"({"stage": "PRM1-Z8", "travel_mm": [0, 9]})");
  CHECK(travel.hint.find("travel_deg") != std::string::npos);
  CHECK(refusal(ati_netft_entry, R"({"stale_after": 1})").hint.find("stale_after_s") !=
        std::string::npos);
  CHECK(refusal(taxel_array_entry, R"({"xyzzy": 1})").hint.empty());
}

TEST_CASE("wrong types, ranges, choices and texts are refused at their JSON pointer") {
  struct Case {
    const DriverEntry* entry;
    const char* config;
    const char* where;
    Errc code;
  };
  const Case cases[] = {
      {&thorlabs_apt_entry, R"({"stage": "LTS15"})", "/stage", Errc::invalid_argument},
      {&thorlabs_apt_entry, R"({"stage": 150})", "/stage", Errc::invalid_argument},
      {&thorlabs_apt_entry, R"({"max_speed_mm_s": 51})", "/max_speed_mm_s", Errc::range},
      {&thorlabs_apt_entry, R"({"max_speed_mm_s": "fast"})", "/max_speed_mm_s",
       Errc::invalid_argument},
      {&thorlabs_apt_entry, R"({"travel_mm": [100, 50]})", "/travel_mm", Errc::range},
      {&thorlabs_apt_entry, R"({"travel_mm": [0, 151]})", "/travel_mm", Errc::range},
      {&thorlabs_apt_entry, R"({"travel_mm": [0]})", "/travel_mm", Errc::invalid_argument},
      {&thorlabs_apt_entry, R"({"travel_mm": 5})", "/travel_mm", Errc::invalid_argument},
      {&thorlabs_apt_entry, R"({"channel": 1.5})", "/channel", Errc::range},
      {&thorlabs_apt_entry, R"({"channel": 0})", "/channel", Errc::range},
      {&thorlabs_apt_entry, R"({"require_homed": 1})", "/require_homed", Errc::invalid_argument},
      {&thorlabs_apt_entry, R"({"family": "brushless"})", "/family", Errc::invalid_argument},
      {&ati_netft_entry, R"({"counts_per_newton": 0})", "/counts_per_newton", Errc::range},
      {&ati_netft_entry, R"({"sign_z": 0.5})", "/sign_z", Errc::range},
      {&ati_netft_entry, R"({"rated_force_n": [40, "x", 120]})", "/rated_force_n", Errc::range},
      {&taxel_array_entry, R"({"taxels": 65})", "/taxels", Errc::range},
      {&taxel_array_entry, R"({"taxels": 12, "form": "cpm_udp"})", "/taxels", Errc::range},
      {&drivers::vibro_entry, R"({"acceleration_rate_hz": 0, "sound_rate_hz": 0})",
       "/sound_rate_hz", Errc::range},
      {&drivers::vibro_entry, R"({"serial": -1})", "/serial", Errc::range},
      {&taxel_array_entry, "[1]", "", Errc::parse},
      {&taxel_array_entry, "", "", Errc::parse},
      {&taxel_array_entry, R"({"taxels": )", "", Errc::parse},
  };
  for (const Case& c : cases) {
    INFO(c.config);
    const Error error = refusal(*c.entry, c.config);
    CHECK(error.where == c.where);
    CHECK(error.code == c.code);
  }
}

TEST_CASE("a stage may be named by a serial number of nine digits") {
  testing::FakeHost host;
  CHECK(thorlabs_apt_entry.create(
      R"({"stage": "DDS220", "controller": "BBD301", "serial": 103259148})", host));
  CHECK(refusal(thorlabs_apt_entry, R"({"serial": 1000000000})").where == "/serial");
}

TEST_CASE("the nearest name is found by edits, and nothing is guessed from afar") {
  CHECK(nearest_name("stgae", {"stage", "channel"}) == "stage");
  CHECK(nearest_name("qqqqqqqqqq", {"stage", "channel"}).empty());
  CHECK(nearest_name("x", {}).empty());
}

TEST_CASE("the lifecycle table has these rows and refuses every other pair") {
  using S = DriverState;
  using E = LifecycleEvent;
  const std::optional<S> no;
  const std::optional<S> expected[4][5] = {
      // opened, armed, disarmed, fault, close
      {S::open, no, no, S::faulted, S::closed},   // closed
      {no, S::armed, no, S::faulted, S::closed},  // open
      {no, no, S::open, S::faulted, S::closed},   // armed
      {no, no, no, no, S::closed},                // faulted
  };
  const S states[] = {S::closed, S::open, S::armed, S::faulted};
  const E events[] = {E::opened, E::armed, E::disarmed, E::fault, E::close};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t k = 0; k < 5; ++k) {
      INFO(to_string(states[i]) << " event " << k);
      CHECK(next(states[i], events[k]) == expected[i][k]);
    }
}

TEST_CASE("a watchdog barks once when nothing came, and costs one timer however often it is fed") {
  TestLoop loop;
  int barks = 0;
  Watchdog dog(loop, [&barks] { ++barks; });
  for (int i = 0; i < 100; ++i) {
    dog.expect_within(from_seconds(0.1));
    CHECK(loop.timers() == 1);
    loop.run_for(0.09);
  }
  CHECK(barks == 0);
  loop.run_for(0.02);
  CHECK(barks == 1);
  loop.run_for(10);
  CHECK(barks == 1);
  dog.expect_within(from_seconds(0.1));
  dog.satisfy();
  loop.run_for(1);
  CHECK(barks == 1);
  CHECK(loop.timers() == 0);
}

TEST_CASE("a watchdog with a shortened limit barks at the shorter limit") {
  TestLoop loop;
  int barks = 0;
  Watchdog dog(loop, [&barks] { ++barks; });
  dog.expect_within(from_seconds(10));
  dog.expect_within(from_seconds(0.1));
  loop.run_for(0.11);
  CHECK(barks == 1);
}

TEST_CASE("a timer that is started again moves, and one that is destroyed never fires") {
  TestLoop loop;
  int fired = 0;
  {
    Timer timer(loop, [&fired] { ++fired; });
    timer.start(from_seconds(1));
    timer.start(from_seconds(2));
    loop.run_for(1.5);
    CHECK(fired == 0);
    loop.run_for(1);
    CHECK(fired == 1);
    timer.start(from_seconds(1));
  }
  loop.run_for(5);
  CHECK(fired == 1);
}

}  // namespace config_test
