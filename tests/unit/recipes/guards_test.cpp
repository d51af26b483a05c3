#include "recipes/control/guards.hpp"

#include <catch2/catch.hpp>
#include <fstream>
#include <set>
#include <string>
#include <vector>

namespace guards_test {

using namespace weft;
using namespace weft::recipes;
using namespace std::chrono_literals;

namespace {

constexpr TimePoint now(10s);

GuardLimits limits() {
  GuardLimits out;
  out.force_cap_n = 10;
  out.torque_cap_nm = 2;
  out.taxel_cap_counts = 1000;
  out.travel = {Range{0, 0.15}, {0, 0.15}, {0, 0.15}, {-0.1, 0.1}, {-0.1, 0.1}};
  out.wrench_max_age = 50ms;
  out.taxels_max_age = 100ms;
  out.stage_max_age = 250ms;
  out.wrench_longest_frozen = 250ms;
  out.taxels_longest_frozen = 1s;
  out.wrench_jump_n = 2.5;
  out.cycle_max_lateness = 250ms;
  out.least_free_bytes = 1000;
  return out;
}

GuardReadings good() {
  GuardReadings out;
  out.force_n = {0.5, 1, 5};
  out.wrench_at = now - 10ms;
  out.taxels_at = now - 27ms;
  out.stage_at.fill(now - 100ms);
  out.position.value = {0.05, 0.05, 0.1, 0, 0};
  return out;
}

GuardTrip tripped(const GuardReadings& readings) {
  const auto trip = evaluate(limits(), readings, now);
  REQUIRE(trip);
  CHECK(trip->error.code == Errc::safety);
  return *trip;
}

}  // namespace

TEST_CASE("Good readings trip nothing") {
  CHECK_FALSE(evaluate(limits(), good(), now));
}

TEST_CASE("A force over the cap trips by its magnitude and fails the trial") {
  GuardReadings r = good();
  r.force_n = {6, 0, 8};
  CHECK_FALSE(evaluate(limits(), r, now));  // exactly 10 N
  r.force_n = {6, 0.1, 8};
  const GuardTrip trip = tripped(r);
  CHECK(trip.guard == Guard::force_cap);
  CHECK(trip.action == GuardAction::fail_trial);
  CHECK(trip.error.expected == "at most 10.000000 N");
  CHECK(trip.error.got.starts_with("10.0005"));
}

TEST_CASE("A pull counts like a push") {
  GuardReadings r = good();
  r.force_n = {0, 0, -11};
  CHECK(tripped(r).guard == Guard::force_cap);
}

TEST_CASE("A torque over the cap trips") {
  GuardReadings r = good();
  r.torque_nm = {0, 2.1, 0};
  CHECK(tripped(r).guard == Guard::torque_cap);
}

TEST_CASE("Readings that are not numbers trip the guard they belong to") {
  GuardReadings force = good();
  force.force_n[1] = std::nan("");
  CHECK(tripped(force).guard == Guard::force_cap);
  GuardReadings place = good();
  place.position[Axis::y] = std::nan("");
  CHECK(tripped(place).guard == Guard::travel);
}

TEST_CASE("A sensor that marks its values as wrong ends the campaign") {
  GuardReadings r = good();
  r.wrench_valid = false;
  CHECK(tripped(r).guard == Guard::invalid_wrench);
  CHECK(tripped(r).action == GuardAction::end_campaign);
}

TEST_CASE("A saturated sensor is reported as such at any force, and ends the campaign") {
  GuardReadings r = good();
  r.wrench_valid = false;
  r.force_n = {40, 40, 120};
  r.torque_nm = {2.5, 0, 0};
  CHECK(tripped(r).guard == Guard::invalid_wrench);
  CHECK(tripped(r).action == GuardAction::end_campaign);
  CHECK_THAT(tripped(r).error.got, Catch::Contains("132.66"));
}

TEST_CASE("A stage outside its travel trips and is named") {
  GuardReadings r = good();
  r.position[Axis::z] = 0.15 + 4e-6;
  CHECK_FALSE(evaluate(limits(), r, now));
  r.position[Axis::z] = 0.15 + 6e-6;
  const GuardTrip trip = tripped(r);
  CHECK(trip.guard == Guard::travel);
  CHECK(trip.error.where == "stage z");
}

TEST_CASE("Streams that stop, or never began, trip at their age") {
  GuardReadings wrench = good();
  wrench.wrench_at = now - 50ms;
  CHECK_FALSE(evaluate(limits(), wrench, now));
  wrench.wrench_at = now - 51ms;
  CHECK(tripped(wrench).guard == Guard::stale_wrench);
  GuardReadings taxels = good();
  taxels.taxels_at.reset();
  CHECK(tripped(taxels).guard == Guard::stale_taxels);
  GuardReadings stage = good();
  stage.stage_at[index(Axis::ry)] = now - 300ms;
  const GuardTrip trip = tripped(stage);
  CHECK(trip.guard == Guard::stale_stage);
  CHECK(trip.error.where == "stage ry");
  CHECK(trip.action == GuardAction::end_campaign);
}

TEST_CASE("A step past its deadline fails the trial") {
  GuardReadings r = good();
  r.deadline = now;
  CHECK_FALSE(evaluate(limits(), r, now));
  r.deadline = now - 1ms;
  CHECK(tripped(r).guard == Guard::deadline);
}

TEST_CASE("The most dangerous of several findings is reported") {
  GuardReadings r = good();
  r.deadline = now - 1s;
  r.taxels_at.reset();
  r.force_n = {0, 0, 50};
  CHECK(tripped(r).guard == Guard::force_cap);
}

TEST_CASE("Findings from the history trip their guard") {
  GuardReadings r = good();
  r.history.wrench_frozen = 249ms;
  r.history.taxels_frozen = 999ms;
  CHECK_FALSE(evaluate(limits(), r, now));
  r.history.taxels_frozen = 1s;
  CHECK(tripped(r).guard == Guard::frozen_taxels);
  r.history.wrench_frozen = 250ms;
  CHECK(tripped(r).guard == Guard::frozen_wrench);
  r = good();
  r.history.too_fast = Axis::x;
  CHECK(tripped(r).guard == Guard::stage_speed);
  CHECK(tripped(r).error.where == "stage x");
  r = good();
  r.history.not_following = Axis::z;
  r.history.following_error = 0.002;
  CHECK(tripped(r).guard == Guard::following_error);
  CHECK_THAT(tripped(r).error.got, Catch::Contains("0.002000 m away"));
}

TEST_CASE("One jump holds, three in a row fail the trial") {
  GuardReadings r = good();
  r.history.wrench_jump_n = 3;
  r.history.wrench_jumps = 2;
  CHECK(tripped(r).guard == Guard::wrench_jump);
  CHECK(tripped(r).action == GuardAction::hold);
  r.history.wrench_jumps = 3;
  CHECK(tripped(r).action == GuardAction::fail_trial);
}

TEST_CASE("A jump that only holds does not hide what ends the trial") {
  GuardReadings r = good();
  r.history.wrench_jumps = 1;
  r.deadline = now - 1s;
  CHECK(tripped(r).guard == Guard::deadline);
}

TEST_CASE("A cycle that comes a quarter of a second late fails the trial") {
  GuardReadings r = good();
  r.cycle_lateness = 250ms;
  CHECK_FALSE(evaluate(limits(), r, now));
  r.cycle_lateness = 251ms;
  CHECK(tripped(r).guard == Guard::late_cycle);
  CHECK(tripped(r).action == GuardAction::fail_trial);
}

TEST_CASE("A disk that fills up lets the trial end; an unknown one is no finding") {
  GuardReadings r = good();
  r.free_bytes = 1000;
  CHECK_FALSE(evaluate(limits(), r, now));
  r.free_bytes = 999;
  CHECK(tripped(r).guard == Guard::disk);
  CHECK(tripped(r).action == GuardAction::finish_trial);
}

TEST_CASE("Each guard trips on its own reading, by its name and with its action") {
  struct Row {
    Guard guard;
    std::string_view name;
    GuardAction action;
    void (*spoil)(GuardReadings&);
  };
  const Row rows[]{{Guard::force_cap, "force_cap", GuardAction::fail_trial,
                    [](GuardReadings& r) { r.force_n[2] = 10.1; }},
                   {Guard::torque_cap, "torque_cap", GuardAction::fail_trial,
                    [](GuardReadings& r) { r.torque_nm[0] = -2.1; }},
                   {Guard::invalid_wrench, "invalid_wrench", GuardAction::end_campaign,
                    [](GuardReadings& r) { r.wrench_valid = false; }},
                   {Guard::frozen_wrench, "frozen_wrench", GuardAction::end_campaign,
                    [](GuardReadings& r) { r.history.wrench_frozen = 250ms; }},
                   {Guard::wrench_jump, "wrench_jump", GuardAction::hold,
                    [](GuardReadings& r) { r.history.wrench_jumps = 1; }},
                   {Guard::travel, "travel", GuardAction::end_campaign,
                    [](GuardReadings& r) { r.position[Axis::rx] = 0.11; }},
                   {Guard::stage_speed, "stage_speed", GuardAction::end_campaign,
                    [](GuardReadings& r) { r.history.too_fast = Axis::y; }},
                   {Guard::following_error, "following_error", GuardAction::end_campaign,
                    [](GuardReadings& r) { r.history.not_following = Axis::ry; }},
                   {Guard::stale_wrench, "stale_wrench", GuardAction::end_campaign,
                    [](GuardReadings& r) { r.wrench_at = now - 51ms; }},
                   {Guard::stale_stage, "stale_stage", GuardAction::end_campaign,
                    [](GuardReadings& r) { r.stage_at[index(Axis::x)] = now - 251ms; }},
                   {Guard::stale_taxels, "stale_taxels", GuardAction::end_campaign,
                    [](GuardReadings& r) { r.taxels_at = now - 101ms; }},
                   {Guard::frozen_taxels, "frozen_taxels", GuardAction::end_campaign,
                    [](GuardReadings& r) { r.history.taxels_frozen = 1s; }},
                   {Guard::taxel_cap, "taxel_cap", GuardAction::fail_trial,
                    [](GuardReadings& r) { r.taxel_change = 1001; }},
                   {Guard::late_cycle, "late_cycle", GuardAction::fail_trial,
                    [](GuardReadings& r) { r.cycle_lateness = 251ms; }},
                   {Guard::deadline, "deadline", GuardAction::fail_trial,
                    [](GuardReadings& r) { r.deadline = now - 1ms; }},
                   {Guard::disk, "disk", GuardAction::finish_trial,
                    [](GuardReadings& r) { r.free_bytes = 999; }}};
  std::set<Guard> seen;
  for (const Row& row : rows) {
    INFO(row.name);
    GuardReadings readings = good();
    row.spoil(readings);
    const GuardTrip trip = tripped(readings);
    CHECK(trip.guard == row.guard);
    CHECK(trip.action == row.action);
    CHECK(to_string(trip.guard) == row.name);
    seen.insert(row.guard);
  }
  CHECK(seen.size() == guard_count);
}

TEST_CASE("The table of guards in force-control.md is the one in code, row by row") {
  std::ifstream in(WEFT_SOURCE_DIR "/docs/explanation/force-control.md");
  std::vector<std::string> documented;
  bool there = false;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with("## ")) there = line == "## Guards";
    if (!there || !line.starts_with("| `")) continue;
    std::erase(line, '`');
    documented.push_back(line);
  }
  std::vector<std::string> in_code;
  for (const GuardRule& rule : guard_table())
    in_code.push_back("| " + std::string(rule.name) + " | " + std::string(rule.trips_when) + " | " +
                      std::string(to_string(rule.action)) + " |");
  CHECK(documented == in_code);
}

}  // namespace guards_test
