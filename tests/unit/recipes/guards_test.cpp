#include "recipes/control/guards.hpp"

#include <catch2/catch.hpp>
#include <cmath>

using namespace weft;
using namespace weft::recipes;
using namespace std::chrono_literals;

namespace {

constexpr TimePoint now(10s);

GuardLimits limits() {
  GuardLimits out;
  out.force_cap_n = 10;
  out.torque_cap_nm = 2;
  out.travel = {Range{0, 0.15}, {0, 0.15}, {0, 0.15}, {-0.1, 0.1}, {-0.1, 0.1}};
  out.wrench_max_age = 50ms;
  out.taxels_max_age = 100ms;
  out.stage_max_age = 250ms;
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
  CHECK_THAT(to_string(trip.error), Catch::Contains("expected <= 10.000000 N, got 10.0005"));
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
  CHECK(tripped(r).action == GuardAction::end_campaign);
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

TEST_CASE("The most dangerous of several findings is the one that is told") {
  GuardReadings r = good();
  r.deadline = now - 1s;
  r.taxels_at.reset();
  r.force_n = {0, 0, 50};
  CHECK(tripped(r).guard == Guard::force_cap);
}
