#include "recipes/control/force_loop.hpp"

#include <catch2/catch.hpp>
#include <deque>
#include <limits>
#include <span>
#include <vector>

#include "tests/unit/recipes/press_model.hpp"

namespace force_loop_test {

using namespace weft::recipes;
using test::Cloth;
using test::cloths;
using test::PressModel;

namespace {

struct Press {
  double settle_s = -1;
  double overshoot_n = -1e9;
  double worst_late_n = 0;  ///< largest error in the last three seconds
};

/// Six seconds of pressing to 5 N from phase S, as the engine requests.
Press press(PressModel& model, ForceLoopState& state) {
  const ForceLoopConfig config;
  SettleDetector settled{0.25, 0.5};
  Press result;
  for (int i = 0; i < 600; ++i) {
    const ForceLoopInput input{5, model.measured_n(), model.reported_z_m(), 0.01};
    model.advance(step(config, state, input).velocity_mps);
    const double error = model.force_n() - 5;
    result.overshoot_n = std::max(result.overshoot_n, error);
    if (i >= 300) result.worst_late_n = std::max(result.worst_late_n, std::abs(error));
    if (settled.step(model.measured_n() - 5, 0.01) && result.settle_s < 0)
      result.settle_s = 0.01 * i;
  }
  return result;
}

/// A linear spring with a delay of `delay` cycles: the discrete loop of docs/reference/plant.md,
/// Instruments and the force loop.
class Spring {
 public:
  Spring(double stiffness_npm, double force_n, int delay)
      : stiffness_npm_(stiffness_npm), start_n_(force_n), past_m_(8, 0), delay_(delay) {}

  void advance(double velocity_mps, double dt_s) {
    past_m_.push_front(past_m_.front() + velocity_mps * dt_s);
    past_m_.pop_back();
  }
  [[nodiscard]] double force_n() const { return start_n_ + stiffness_npm_ * past_m_.front(); }
  [[nodiscard]] double measured_n() const { return start_n_ + stiffness_npm_ * measured_z_m(); }
  [[nodiscard]] double measured_z_m() const { return past_m_[static_cast<std::size_t>(delay_)]; }

 private:
  double stiffness_npm_, start_n_;
  std::deque<double> past_m_;
  int delay_;
};

/// Force errors of the bare proportional loop, cycle by cycle, as multiples of the first one.
std::vector<double> errors(double loop_gain, int delay, int cycles) {
  ForceLoopConfig config;
  config.loop_gain = loop_gain;
  config.integral_time_s = 1e12;
  config.position_quantum_m = 1e-18;
  config.max_acceleration_mps2 = 1e12;
  config.max_speed_mps = 1e12;
  config.stiffness_initial_npm = 1e4;
  config.latency_s = 0;
  config.hold.band_n = -1;  // never
  ForceLoopState state;
  Spring spring(1e4, 4.9, delay);
  std::vector<double> found;
  for (int i = 0; i < cycles; ++i) {
    const ForceLoopInput input{5, spring.measured_n(), spring.measured_z_m(), 0.01, false};
    spring.advance(step(config, state, input).velocity_mps, 0.01);
    found.push_back((5 - spring.force_n()) / 0.1);
  }
  return found;
}

/// Largest of the last errors after many cycles.
double growth(double loop_gain, int delay) {
  const std::vector<double> all = errors(loop_gain, delay, 4000);
  double late = 0;
  for (const double e : std::span(all).last(50)) late = std::max(late, std::abs(e));
  return late;
}

}  // namespace

TEST_CASE("The force settles in its band on every cloth, with none to two cycles of delay") {
  for (const int delay : {0, 1, 2})
    for (const Cloth& cloth : cloths) {
      PressModel model({.cloth = cloth, .delay_cycles = delay});
      ForceLoopState state;
      const Press result = press(model, state);
      INFO(cloth.name << ", delay " << delay);
      CHECK(result.settle_s > 0.5);  // the dwell alone takes this long
      CHECK(result.settle_s < 2.5);
      CHECK(result.overshoot_n < 0.2);
      CHECK(result.worst_late_n < 0.08);
    }
}

TEST_CASE("The estimate of stiffness comes near cloth and mount in series") {
  // At 5 N: K = (F + A p_s) / lambda for the fabric, 2e4 N/m for the mount.
  for (const Cloth& cloth : cloths) {
    PressModel model({.cloth = cloth});
    ForceLoopState state;
    press(model, state);
    const double cloth_npm = (5 + 2.56e-4 * cloth.pressure_pa) / cloth.lambda_m;
    const double series_npm = 1 / (1 / cloth_npm + 1 / 2e4);
    INFO(cloth.name);
    CHECK(state.stiffness_npm > 0.6 * series_npm);
    CHECK(state.stiffness_npm < 1.6 * series_npm);
  }
}

TEST_CASE("The force stays in its band while the cloth's height varies under the slide") {
  for (const Cloth& cloth : cloths) {
    PressModel model({.cloth = cloth, .delay_cycles = 2});
    ForceLoopState state;
    press(model, state);
    double worst = 0;
    for (int i = 0; i < 2500; ++i) {
      const double x_m = 2e-3 * 0.01 * i;
      model.set_height(8e-6 * std::sin(2 * M_PI * x_m / 1e-3) +
                       30e-6 * std::sin(2 * M_PI * x_m / 20e-3));
      const ForceLoopInput input{5, model.measured_n(), model.reported_z_m(), 0.01, false};
      model.advance(step({}, state, input).velocity_mps);
      worst = std::max(worst, std::abs(model.force_n() - 5));
    }
    INFO(cloth.name);
    CHECK(worst < 0.2);
  }
}

TEST_CASE("The proportional loop is stable up to the gains of the closed form") {
  // docs/reference/plant.md: K k_p T < 2, 1, 0.618 for 0, 1, 2 cycles of delay.
  const double limit[]{2, 1, (std::sqrt(5.0) - 1) / 2};
  for (const int delay : {0, 1, 2}) {
    INFO("delay " << delay);
    CHECK(growth(0.998 * limit[delay], delay) < 0.5);
    CHECK(growth(1.002 * limit[delay], delay) > 2);
  }
}

TEST_CASE("The proportional loop has the poles of z^(d+1) - z^d + g, cycle by cycle") {
  for (const int delay : {0, 1, 2})
    for (const double gain : {0.1, 0.3, 0.6}) {
      INFO("delay " << delay << ", gain " << gain);
      std::vector<double> expected(static_cast<std::size_t>(delay) + 1, 1.0);
      for (const double found : errors(gain, delay, 60)) {
        expected.push_back(expected.back() - gain * *(expected.end() - 1 - delay));
        REQUIRE(found == Approx(expected.back()).margin(1e-10));
      }
    }
}

TEST_CASE("The loop comes to rest within one quantum for any stiffness from 10 to 1e8 N/m") {
  const ForceLoopConfig config;
  for (const int delay : {0, 1, 2})
    for (double stiffness = 10; stiffness <= 1e8; stiffness *= 10) {
      Spring spring(stiffness, 4.5, delay);
      ForceLoopState state;
      double late = 0;
      for (int i = 0; i < 20'000; ++i) {
        const ForceLoopInput input{5, spring.measured_n(), spring.measured_z_m(), 0.01};
        spring.advance(step(config, state, input).velocity_mps, 0.01);
        if (i >= 19'000) late = std::max(late, std::abs(spring.force_n() - 5));
      }
      INFO("K " << stiffness << ", delay " << delay);
      CHECK(late <= std::max(0.06, 1.01e-6 * stiffness));
    }
}

TEST_CASE("A slower cycle lowers the gain instead of making the loop unstable") {
  PressModel model({.cloth = cloths[5], .delay_cycles = 1, .cycle_s = 0.027});
  ForceLoopState state;
  double worst = 0;
  for (int i = 0; i < 300; ++i) {
    const ForceLoopInput input{5, model.measured_n(), model.reported_z_m(), 0.027};
    model.advance(step({}, state, input).velocity_mps);
    if (i > 150) worst = std::max(worst, std::abs(model.force_n() - 5));
  }
  CHECK(worst < 0.15);
}

TEST_CASE("The command never passes its clamp and points towards the set point") {
  ForceLoopState state;
  const ForceLoopConfig config;
  CHECK(step(config, state, {5, 0, 0, 0.01}).velocity_mps > 0);
  CHECK(step(config, state, {1e300, 0, 0, 0.01}).velocity_mps == config.max_speed_mps);
  ForceLoopState other;
  CHECK(step(config, other, {5, 9, 0, 0.01}).velocity_mps < 0);
}

TEST_CASE("Input that is not a number gives no motion and leaves no trace") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  for (const ForceLoopInput& bad : {ForceLoopInput{nan, 5, 0, 0.01},
                                    {5, nan, 0, 0.01},
                                    {5, 5, inf, 0.01},
                                    {5, 5, 0, nan},
                                    {5, 5, 0, 0},
                                    {5, 5, 0, -1}}) {
    ForceLoopState state;
    CHECK(step({}, state, bad).velocity_mps == 0);
    CHECK_FALSE(state.primed);
  }
}

TEST_CASE("A long saturation does not wind the integral up") {
  ForceLoopState state;
  for (int i = 0; i < 10'000; ++i) step({}, state, {5, 0, 0, 0.01});
  CHECK(std::abs(state.integral_n) < 1e-9);
}

TEST_CASE("The settle detector wants the whole dwell without a break") {
  SettleDetector detector{0.25, 0.05};
  for (int i = 0; i < 4; ++i) CHECK_FALSE(detector.step(0.2, 0.01));
  CHECK_FALSE(detector.step(0.3, 0.01));
  for (int i = 0; i < 4; ++i) CHECK_FALSE(detector.step(-0.2, 0.01));
  CHECK(detector.step(0.1, 0.011));
  CHECK_FALSE(detector.step(std::nan(""), 0.01));
}

TEST_CASE("Without a dwell a force is settled once it is in the band, and never outside of it") {
  SettleDetector detector{0.25, 0};
  CHECK_FALSE(detector.step(-3.04, 0.01));  // 1.96 N of 5 N
  CHECK_FALSE(detector.step(std::nan(""), 0.01));
  CHECK(detector.step(-0.25, 0.01));
  CHECK_FALSE(detector.step(0.26, 0.01));
}

}  // namespace force_loop_test
