#include "recipes/control/guard_watch.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "recipes/control/servo.hpp"

namespace guard_watch_test {

using namespace weft;
using namespace weft::recipes;
using namespace std::chrono_literals;

namespace {

WatchLimits limits() {
  WatchLimits out;
  out.wrench_jump_n = 2.5;
  out.landing_n = 4;  // a heavy probe
  out.wrench_gap = 50ms;
  out.max_speed = {4e-3, 4e-3, 4e-3, 0.087, 0.087};
  out.max_acceleration = {20e-3, 20e-3, 20e-3, 0.087, 0.087};
  out.order_age = order_age(100);
  return out;
}

/// A bench with readings in each cycle, at its own times.
struct Bench {
  GuardWatch watch;
  Duration period = 10ms;
  std::array<TaxelReading, 2> taxels;
  WatchInput input;
  GuardHistory seen;
  TimePoint now{10s};
  int cycles = 0;

  explicit Bench(const WatchLimits& with = limits()) : watch(with) {
    input.position.value = {0.05, 0.05, 0.05, 0, 0};
  }

  /// Noise of the last bit keeps the streams alive.
  void cycle(bool wrench_alive = true, bool taxels_alive = true, bool second_alive = true) {
    now += period;
    ++cycles;
    input.wrench_at = taxels[0].at = taxels[1].at = now;
    input.taxels = taxels;
    if (wrench_alive) input.torque_nm[2] = 1e-6 * cycles;
    if (taxels_alive) taxels[0].digest = static_cast<std::uint32_t>(cycles);
    if (second_alive) taxels[1].digest = static_cast<std::uint32_t>(cycles);
    input.stage_at.fill(now);
    seen = watch.step(input, now);
  }
  double& z() { return input.position.value[index(Axis::z)]; }
};

}  // namespace

TEST_CASE("A wrench with six constant values grows old although it is still received") {
  Bench b;
  for (int i = 0; i < 20; ++i) b.cycle();
  CHECK(b.seen.wrench_frozen == 0ms);
  for (int i = 0; i < 25; ++i) b.cycle(false);
  CHECK(b.seen.wrench_frozen == 250ms);
  b.cycle();
  CHECK(b.seen.wrench_frozen == 0ms);
}

TEST_CASE("Constant taxels are reported, and one changed count is enough") {
  Bench b;
  b.cycle();
  for (int i = 0; i < 100; ++i) b.cycle(true, false);
  CHECK(b.seen.taxels_frozen == 1s);
  b.cycle();
  CHECK(b.seen.taxels_frozen == 0s);
  for (int i = 0; i < 100; ++i) b.cycle(true, true, false);
  CHECK(b.seen.taxels_frozen == 1s);
}

TEST_CASE("One reading far away is one jump, and the last one believed stays the measure") {
  Bench b;
  b.input.force_n = {0, 0, 5};
  b.cycle();
  b.input.force_n = {0, 0, 7.6};
  b.cycle();
  CHECK(b.seen.wrench_jumps == 1);
  CHECK(b.seen.wrench_jump_n == Approx(2.6));
  b.input.force_n = {0, 0, 5.1};
  b.cycle();
  CHECK(b.seen.wrench_jumps == 0);
  b.input.force_n = {0, 0, 9};
  for (int i = 0; i < 3; ++i) b.cycle();
  CHECK(b.seen.wrench_jumps == 3);
}

TEST_CASE("A fast press is no jump, nor is what comes after a gap or while the zero moves") {
  Bench b;
  for (int i = 0; i < 10; ++i) {
    b.input.force_n[2] += 2.4;
    b.cycle();
    CHECK(b.seen.wrench_jumps == 0);
  }
  b.now += 60ms;
  b.input.force_n[2] += 20;
  b.cycle();
  CHECK(b.seen.wrench_jumps == 0);
  b.input.zero_moves = true;
  b.input.force_n[2] = 0;
  b.cycle();
  CHECK(b.seen.wrench_jumps == 0);
}

TEST_CASE("A stage at twice its speed is found within half a second, at its speed never") {
  Bench fine, fast;
  int found = 0;
  for (int i = 1; i <= 300; ++i) {
    fine.z() += 4e-5;
    fast.z() += 8e-5;
    fine.cycle();
    fast.cycle();
    CHECK_FALSE(fine.seen.too_fast);
    if (fast.seen.too_fast && found == 0) found = i;
  }
  CHECK(fast.seen.too_fast == Axis::z);
  CHECK(found > 0);
  CHECK(found < 50);
}

TEST_CASE("Positions that a stall of the host held back are no speed; a leap is") {
  Bench b;
  for (int i = 0; i < 50; ++i) {
    b.z() += 4e-5;
    b.cycle();
  }
  b.now += 200ms;  // the present reading has this age, the next one is new
  b.cycle();
  b.z() += 8e-4;
  b.cycle();
  CHECK_FALSE(b.seen.too_fast);
  b.z() += 2e-3;
  b.cycle();
  CHECK(b.seen.too_fast == Axis::z);
}

TEST_CASE("A stage without motion is found by its missing travel") {
  Bench b;
  b.cycle();
  b.watch.moved(Axis::y, 0.05, 0.10, 4e-3, b.now);
  int cycles = 0;
  while (!b.seen.not_following && cycles < 1000) {
    b.cycle();
    ++cycles;
  }
  CHECK(b.seen.not_following == Axis::y);
  CHECK(cycles > 60);   // 0.3 s, two ramps of 0.2 s, 0.2 mm
  CHECK(cycles < 100);  // the driver's own check takes three seconds
  b.watch.released(Axis::y, b.now);
  b.cycle();
  CHECK_FALSE(b.seen.not_following);
}

TEST_CASE("A trapezoid with latency follows its command; half its speed does not") {
  for (const double share : {1.0, 0.5}) {
    Bench b;
    b.cycle();
    b.watch.moved(Axis::x, 0.05, 0.03, 4e-3, b.now);
    bool lost = false;
    for (int i = 1; i <= 700; ++i) {
      const double t_s = std::max(0.0, 0.01 * i - 0.03);
      const double ramp_s = std::min(t_s, 0.2);
      const double way = 0.5 * 20e-3 * ramp_s * ramp_s + 4e-3 * std::max(0.0, t_s - 0.2);
      b.input.position.value[0] = 0.05 - std::min(0.02, share * way);
      b.cycle();
      lost = lost || b.seen.not_following.has_value();
    }
    CHECK(lost == (share < 1));
  }
}

TEST_CASE("Under the force loop a stage that keeps up is let be, and one that stalls is found") {
  for (const bool stalls : {false, true}) {
    Bench b;
    b.cycle();
    bool lost = false;
    double speed = 0;
    for (int i = 0; i < 300; ++i) {
      const double wanted = 0.4e-3 * std::sin(0.02 * i);
      b.watch.driven(Axis::z, wanted, 100ms, b.now);
      speed += std::clamp(wanted - speed, -2e-4, 2e-4);
      if (!stalls) b.z() += 0.01 * speed;
      b.cycle();
      lost = lost || b.seen.not_following.has_value();
    }
    CHECK(lost == stalls);
  }
}

TEST_CASE("A velocity that has run out asks for nothing more") {
  Bench b;
  b.cycle();
  b.watch.driven(Axis::z, 0.5e-3, 100ms, b.now);
  for (int i = 0; i < 100; ++i) {
    if (i < 10) b.z() += 5e-6;
    b.cycle();
    CHECK_FALSE(b.seen.not_following);
  }
}

namespace {

/// A stage moves down at one speed, then at another, with a ramp of 20 mm/s2, and receives orders
/// 50 ms late; `deaf`: it ignores all orders after the first. Returns whether the watch found that
/// it does not follow.
bool found_on_the_way_down(double first_mps, double then_mps, bool deaf = false) {
  Bench b;
  b.cycle();
  std::vector<double> orders(5, 0.0);
  double pace = 0;
  bool found = false;
  const auto go = [&](double wanted) {
    orders.push_back(deaf && wanted != first_mps ? first_mps : wanted);
    pace += std::clamp(orders[orders.size() - 6] - pace, -2e-4, 2e-4);
    b.z() += 0.01 * pace;
    b.cycle();
    found = found || b.seen.not_following.has_value();
  };
  for (int i = 0; i < 200; ++i) {
    b.watch.driven(Axis::z, first_mps, 100ms, b.now);
    go(first_mps);
  }
  b.watch.released(Axis::z, b.now);
  go(0);
  for (int i = 0; i < 200; ++i) {
    b.watch.driven(Axis::z, then_mps, 100ms, b.now);
    go(then_mps);
  }
  return found;
}

}  // namespace

namespace {

/// A descent of a stage that is commanded, cycle by cycle, to the position that its velocity
/// reaches within 100 ms, and that must be able to stop there. Its positions are read 2 ms after
/// the previous cycle. Returns the time at which the watch found that it does not follow, 0: never.
Duration found_driven_after(int cycle_ms, double acceleration_mps2, double speed_mps,
                            bool is_still) {
  WatchLimits with = limits();
  with.max_acceleration[index(Axis::z)] = acceleration_mps2;
  with.order_age = order_age(1000.0 / cycle_ms);
  Bench b(with);
  b.period = std::chrono::milliseconds(cycle_ms);
  b.cycle();
  double at = b.z(), pace = 0;
  for (int i = 1; i * b.period <= 4s; ++i) {
    b.watch.driven(Axis::z, speed_mps, 100ms, b.now);
    const double target = b.z() + 0.1 * speed_mps;
    for (int ms = 0; ms < cycle_ms && !is_still; ++ms) {
      const bool brakes = target - at <= 0.5 * pace * pace / acceleration_mps2;
      pace += std::clamp((brakes ? 0 : speed_mps) - pace, -1e-3 * acceleration_mps2,
                         1e-3 * acceleration_mps2);
      at += 1e-3 * pace;
      if (ms == 1) b.z() = at;
    }
    b.cycle();
    if (b.seen.not_following) return i * b.period;
  }
  return 0s;
}

}  // namespace

TEST_CASE("A stage that cannot reach its velocity within the horizon is no following error") {
  for (const int cycle_ms : {4, 10, 20, 50, 100})
    for (const double a_mm_s2 : {1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0})
      for (const double v_mm_s : {0.5, 1.0, 2.0, 4.0, 8.0}) {
        CAPTURE(cycle_ms, a_mm_s2, v_mm_s);
        CHECK(found_driven_after(cycle_ms, a_mm_s2 * 1e-3, v_mm_s * 1e-3, false) == 0s);
        const Duration found = found_driven_after(cycle_ms, a_mm_s2 * 1e-3, v_mm_s * 1e-3, true);
        CHECK(found > 0s);
        CHECK(found < 700ms);
      }
}

TEST_CASE("A stage that brakes from its way down is let be, one that does not brake is found") {
  for (const double first_mm_s : {0.5, 2.0, 4.0})
    for (const double then_mm_s : {0.01, 0.05, 0.12, 0.5}) {
      CAPTURE(first_mm_s, then_mm_s);
      CHECK_FALSE(found_on_the_way_down(first_mm_s * 1e-3, then_mm_s * 1e-3));
      if (then_mm_s < first_mm_s)
        CHECK(found_on_the_way_down(first_mm_s * 1e-3, then_mm_s * 1e-3, true));
    }
}

TEST_CASE("A stage that stops on a slow descent after a fast one is found") {
  Bench b;
  b.cycle();
  for (int i = 0; i < 100; ++i) {
    b.watch.driven(Axis::z, 4e-3, 100ms, b.now);
    b.z() += 4e-5;
    b.cycle();
  }
  b.watch.released(Axis::z, b.now);
  int cycles = 0;
  for (; cycles < 200 && !b.seen.not_following; ++cycles) {
    b.watch.driven(Axis::z, 0.5e-3, 100ms, b.now);
    b.cycle();
  }
  CHECK(b.seen.not_following == Axis::z);
  CHECK(cycles < 100);
}

TEST_CASE("Up to the probe's weight may load the fabric at once while z travels") {
  enum Way { down, up, turning, none };
  const auto jumps = [](std::array<double, 3> step_n, Way way) {
    Bench b;
    b.cycle();
    b.input.can_land = way == down || way == turning;
    b.input.can_lift = way == up || way == turning;
    b.input.force_n = step_n;
    b.cycle();
    return b.seen.wrench_jumps;
  };
  CHECK(jumps({0, 0, 3.9}, down) == 0);
  CHECK(jumps({0, 0, -3.9}, up) == 0);  // and leaves again
  CHECK(jumps({0, 0, -3.9}, down) == 1);
  CHECK(jumps({0, 0, 3.9}, up) == 1);
  CHECK(jumps({0, 0, 3.9}, turning) == 0);
  CHECK(jumps({0, 0, -3.9}, turning) == 0);
  CHECK(jumps({0, 0, 4.1}, turning) == 1);
  CHECK(jumps({0, 2.6, 3.9}, down) == 1);
  CHECK(jumps({0, 0, 2.6}, none) == 1);  // the fabric keeps the force
}

TEST_CASE("Values that are not numbers end nothing here: the guards on single readings see them") {
  Bench b;
  b.input.force_n[0] = std::nan("");
  b.z() = std::nan("");
  for (int i = 0; i < 3; ++i) b.cycle();
  CHECK(b.seen.wrench_jumps == 0);
  b.input.force_n[0] = 0;
  b.z() = 0.05;
  for (int i = 0; i < 3; ++i) b.cycle();
  CHECK_FALSE(b.seen.too_fast);
  CHECK_FALSE(b.seen.not_following);
}

}  // namespace guard_watch_test
