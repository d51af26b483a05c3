
#include <catch2/catch.hpp>
#include <cmath>

#include "sim/plant/random.hpp"
#include "sim/plant/stage.hpp"

namespace profile_test {

using namespace weft;
using namespace weft::sim;

namespace {
constexpr MotionLimits limits{4e-3, 20e-3};
}

TEST_CASE("a long move is a trapezoid") {
  const Profile move = Profile::to_target(0, 0, 50e-3, limits);
  CHECK(move.duration_s() == Approx(50e-3 / 4e-3 + 4e-3 / 20e-3).epsilon(1e-12));
  CHECK(move.velocity(5) == Approx(4e-3));
  CHECK(move.position(move.duration_s() / 2) == Approx(25e-3).epsilon(1e-12));
  CHECK(move.position(100) == 50e-3);
}

TEST_CASE("a move shorter than v^2/a is a triangle that never reaches the speed") {
  const double distance = 0.25 * limits.speed * limits.speed / limits.acceleration;
  const Profile move = Profile::to_target(1e-3, 0, 1e-3 - distance, limits);
  CHECK(move.duration_s() == Approx(2 * std::sqrt(distance / limits.acceleration)).epsilon(1e-12));
  const double peak = move.velocity(move.duration_s() / 2);
  CHECK(peak == Approx(-std::sqrt(distance * limits.acceleration)).epsilon(1e-9));
}

TEST_CASE("a move from a velocity keeps position and velocity continuous and its limits") {
  Random random(5);
  for (int trial = 0; trial < 2000; ++trial) {
    const double p0 = random.uniform(-0.1, 0.1), v0 = random.uniform(-8e-3, 8e-3);
    const double target = random.uniform(-0.1, 0.1) * (trial % 3 == 0 ? 1e-3 : 1);
    const Profile move = Profile::to_target(p0, v0, target, limits);
    const double end = move.duration_s(), dt = end / 200;
    CHECK(move.position(0) == p0);
    CHECK(move.velocity(0) == v0);
    CHECK(move.position(end * (1 - 1e-12)) == Approx(target).margin(1e-12));
    for (int i = 0; i < 200; ++i) {
      const double v = move.velocity(i * dt), next = move.velocity((i + 1) * dt);
      REQUIRE(std::abs(next - v) <= limits.acceleration * dt * (1 + 1e-9));
      REQUIRE(std::abs(v) <= std::max(limits.speed, std::abs(v0)) * (1 + 1e-9));
      REQUIRE(std::abs(move.position((i + 1) * dt) - move.position(i * dt)) <=
              std::max(std::abs(v0), limits.speed) * dt * (1 + 1e-9));
    }
  }
}

TEST_CASE("an S-curve has the duration of its closed form, in all four of its shapes") {
  const double v = 4e-3, a = 20e-3;
  for (const double jerk : {1e-3, 16e-3, 128e-3, 4.0, 131.072}) {  // bow values of a Thorlabs stage
    const MotionLimits smooth{v, a, jerk};
    const double to_speed = v * jerk >= a * a ? a / jerk + v / a : 2 * std::sqrt(v / jerk);
    for (const double distance : {1e-9, 1e-6, 30e-6, 0.4e-3, 0.79e-3, 5e-3, 50e-3})
      for (const double sign : {1.0, -1.0}) {
        CAPTURE(jerk, distance, sign);
        double expected = distance / v + to_speed;
        if (distance < v * to_speed)
          expected = distance >= 2 * a * a * a / (jerk * jerk)
                         ? a / jerk + std::sqrt(a / jerk * a / jerk + 4 * distance / a)
                         : std::cbrt(32 * distance / jerk);
        const Profile move = Profile::to_target(0, 0, sign * distance, smooth);
        CHECK(move.duration_s() == Approx(expected).epsilon(1e-12));
        // The second half mirrors the first in time and position.
        CHECK(move.position(expected / 2) == Approx(sign * distance / 2).epsilon(1e-12));
        CHECK(move.position(expected * (1 - 1e-12)) == Approx(sign * distance).epsilon(1e-12));
        CHECK(std::abs(move.velocity(expected * (1 - 1e-12))) < 1e-11);
      }
  }
}

TEST_CASE("an S-curve keeps speed, acceleration and jerk, and without a limit is the trapezoid") {
  const MotionLimits smooth{4e-3, 20e-3, 128e-3};
  for (const double distance : {2e-6, 0.5e-3, 20e-3}) {
    const Profile move = Profile::to_target(0, 0, distance, smooth);
    const double dt = move.duration_s() / 1000;
    double acceleration = 0;
    for (int i = 0; i < 1000; ++i) {
      const double v0 = move.velocity(i * dt), v1 = move.velocity((i + 1) * dt);
      const double next = (v1 - v0) / dt;
      REQUIRE(std::abs(v1) <= smooth.speed * (1 + 1e-12));
      REQUIRE(std::abs(next) <= smooth.acceleration * (1 + 1e-9));
      REQUIRE(std::abs(next - acceleration) <= smooth.jerk * dt * (1 + 1e-6));
      const double middle = move.velocity((i + 0.5) * dt);  // Simpson: exact for quadratics
      REQUIRE(move.position((i + 1) * dt) - move.position(i * dt) ==
              Approx(dt * (v0 + 4 * middle + v1) / 6).margin(smooth.jerk * dt * dt * dt));
      acceleration = next;
    }
    const Profile sharp = Profile::to_target(0, 0, distance, {4e-3, 20e-3, 1e9});
    const Profile trapezoid = Profile::to_target(0, 0, distance, limits);
    for (double t = 0; t < 1.1 * trapezoid.duration_s(); t += trapezoid.duration_s() / 37)
      CHECK(sharp.position(t) == Approx(trapezoid.position(t)).margin(1e-11));
  }
}

TEST_CASE("moving away first costs the braking and the way back") {
  const Profile move = Profile::to_target(0, -4e-3, 10e-3, limits);
  const double back = 4e-3 * 4e-3 / (2 * 20e-3);
  // brakes 0.2 s, then a trapezoid over the distance and the overrun
  CHECK(move.duration_s() == Approx(0.2 + (10e-3 + back) / 4e-3 + 0.2).epsilon(1e-12));
}

TEST_CASE("a stage re-planned on its way does not jump") {
  Stage stage({.low = 0, .high = 0.15, .start = 0.01, .quantum = 0});
  TimePoint t{};
  stage.move_to(0.1, limits, t);
  double position = stage.position(t), velocity = 0;
  Random random(9);
  for (int i = 0; i < 500; ++i) {
    t += std::chrono::milliseconds(10);
    CHECK(std::abs(stage.position(t) - position) <= 4e-3 * 0.01 * (1 + 1e-9));
    CHECK(std::abs(stage.velocity(t) - velocity) <= 20e-3 * 0.01 * (1 + 1e-9));
    position = stage.position(t);
    velocity = stage.velocity(t);
    if (i % 7 == 0) stage.move_to(random.uniform(0, 0.15), limits, t);
    CHECK(stage.position(t) == position);
    CHECK(stage.velocity(t) == Approx(velocity).margin(1e-15));
  }
}

TEST_CASE("a stage stays inside its travel, rests on its quantum and has play") {
  Stage stage({.low = 0, .high = 0.15, .start = 0, .quantum = 1e-6, .backlash = 10e-6});
  stage.move_to(1, {0.1, 1}, {});
  const TimePoint end = stage.end();
  stage.settle(end);
  CHECK(stage.position(end) == 0.15);
  CHECK(stage.carriage(end) == Approx(0.15 - 5e-6).epsilon(1e-12));
  stage.move_to(0.1, {0.1, 1}, end);
  stage.settle(stage.end());
  CHECK(stage.carriage(stage.end()) == Approx(0.1 + 5e-6).epsilon(1e-12));
  stage.move_to(0.1 + 4.4e-6, {0.1, 1}, stage.end());
  CHECK(stage.carriage(stage.end()) == Approx(0.1 + 5e-6).epsilon(1e-12));
}

}  // namespace profile_test
