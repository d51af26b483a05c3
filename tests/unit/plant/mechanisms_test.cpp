// Relaxation, hysteresis, friction and the mount, each against its closed form.

#include <catch2/catch.hpp>
#include <cmath>

#include "sim/plant/contact.hpp"
#include "sim/plant/fabric_law.hpp"

namespace mechanisms_test {

using namespace weft::sim;

namespace {

constexpr Relaxation cloth{{0.2, 0.15}, {0.3, 5}};

double force_after(double elastic_n, double total_s, double dt_s) {
  RelaxationState state;
  RelaxationStep(cloth, 0).advance(state, elastic_n);  // the jump
  const int steps = static_cast<int>(std::lround(total_s / dt_s));
  double force = elastic_n;
  for (int i = 0; i < steps; ++i) {
    const RelaxationStep step(cloth, dt_s);
    force = step.gain * elastic_n - step.offset_n(state);
    step.advance(state, elastic_n);
  }
  return force;
}

}  // namespace

TEST_CASE("relaxation after a jump follows the Prony series at any step") {
  const double elastic = 5, total = 8;
  double exact = elastic;
  for (std::size_t i = 0; i < Relaxation::terms; ++i)
    exact -= cloth.share[i] * elastic * -std::expm1(-total / cloth.time_s[i]);
  for (const double dt : {1e-3, 3.2e-3, 0.025, 0.5, 8.0})
    CHECK(force_after(elastic, total, dt) == Approx(exact).epsilon(1e-12));
}

TEST_CASE("relaxation under a ramp is exact at any step") {
  // q' = (g r t - q)/tau from rest: q = g r (t - tau (1 - e^{-t/tau})).
  const double rate = 2, total = 4;
  double relaxed = 0;
  for (std::size_t i = 0; i < Relaxation::terms; ++i)
    relaxed +=
        cloth.share[i] * rate * (total + cloth.time_s[i] * std::expm1(-total / cloth.time_s[i]));
  for (const int steps : {1, 8, 1000}) {
    RelaxationState state;
    for (int i = 1; i <= steps; ++i)
      RelaxationStep(cloth, total / steps).advance(state, rate * total * i / steps);
    CHECK(state.relaxed_n[0] + state.relaxed_n[1] == Approx(relaxed).epsilon(1e-11));
  }
}

TEST_CASE("hysteresis turns round within its length, however the path is cut") {
  const double length = 0.4;
  const double once = branch_after(1, -1, std::exp(-1 / length));
  double cut = 1;
  for (int i = 0; i < 10; ++i) cut = branch_after(cut, -0.1, std::exp(-0.1 / length));
  CHECK(once == Approx(-1 + 2 * std::exp(-1 / length)).epsilon(1e-12));
  CHECK(cut == Approx(once).epsilon(1e-12));
}

TEST_CASE("the work that comes back from a press is the resilience") {
  const double resilience = 0.4, eta = (1 - resilience) / (1 + resilience);
  const double length = 1e-3;  // turns at once: only the two curves
  double work_in = 0, work_out = 0, branch = 1, last = 0;
  constexpr int steps = 200000;
  const auto press = [&](double s, double& work) {
    branch = branch_after(branch, s - last, std::exp(-std::abs(s - last) / length));
    work += std::expm1(0.5 * (s + last)) * branch_factor(branch, eta) * std::abs(s - last);
    last = s;
  };
  for (int i = 1; i <= steps; ++i) press(6.0 * i / steps, work_in);
  for (int i = steps - 1; i >= 0; --i) press(6.0 * i / steps, work_out);
  CHECK(work_out / work_in == Approx(resilience).epsilon(3e-3));
}

TEST_CASE("bristles deflect as 1 - e^{-d/l} from rest, in one step or in many") {
  const double length = 150e-6, distance = 200e-6;
  const Vector2 whole = bristle_after({}, {0.6 * distance, 0.8 * distance}, length);
  Vector2 cut{};
  for (int i = 0; i < 50; ++i)
    cut = bristle_after(cut, {0.6 * distance / 50, 0.8 * distance / 50}, length);
  const double exact = -std::expm1(-distance / length);
  CHECK(whole[0] == Approx(0.6 * exact).epsilon(1e-12));
  CHECK(whole[1] == Approx(0.8 * exact).epsilon(1e-12));
  CHECK(cut[0] == Approx(whole[0]).epsilon(1e-12));
  CHECK(bristle_after(whole, {0, 0}, length) == whole);
}

TEST_CASE("friction grows less than the load, and is the coefficient's at the reference load") {
  const Friction friction{0.2, 5, 0.9, 1e-4};
  CHECK(friction.sliding_n(5) == Approx(1.0));
  CHECK(friction.sliding_n(10) == Approx(std::pow(2.0, 0.9)).epsilon(1e-12));
  CHECK(friction.sliding_n(0) == 0);
  CHECK(friction.sliding_n(-1) == 0);
}

TEST_CASE("the mount pushes, rests or carries") {
  const Mount mount;
  CHECK(mount.force_n(1e-4) == Approx(2.0));
  CHECK(mount.force_n(-mount.slack_m / 2) == 0);
  CHECK(mount.force_n(mount.hanging_extension_m()) == Approx(-mount.weight_n()).epsilon(1e-12));
}

}  // namespace mechanisms_test
