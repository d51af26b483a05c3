#include "sim/plant/dynamic/lugre.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "tests/unit/plant/dynamic_support.hpp"

namespace lugre_test {

using namespace weft::sim;
using test::bristle_after_slip;

namespace {

/// 5 N on a fabric: the stick-slip scene of docs/reference/plant.md, Friction. The length of the
/// bristles gives a similar cycle: 0.31 N at 24 Hz on 1e4 N/m, 0.54 N at 2.8 Hz on 1e3 N/m.
constexpr double mass_kg = 0.2;
constexpr double drive_mps = 2e-3;

LuGre cloth() {
  LuGre lugre{.kinetic_n = 1, .static_ratio = 1.3, .stribeck_mps = 5e-3, .length_m = 10e-6};
  lugre.damping_n_s_m = 2 * 0.3 * std::sqrt(lugre.kinetic_n / lugre.length_m * mass_kg);
  return lugre;
}

GlideLaw guide(double stiffness_n_m, double damping_ratio = 0.05) {
  return {mass_kg, stiffness_n_m, 2 * damping_ratio * std::sqrt(stiffness_n_m * mass_kg)};
}

/// Range of the spring's force, and frequency of changes from sticking to slipping.
struct Cycle {
  double peak_to_peak_n, frequency_hz;
};

class CycleMeter {
 public:
  void see(double t_s, double force_n, double room_mps) {
    low_ = std::min(low_, force_n);
    high_ = std::max(high_, force_n);
    if (room_mps < -0.5 * drive_mps) armed_ = true;
    if (armed_ && room_mps > 0.5 * drive_mps) {
      armed_ = false;
      if (slips_++ == 0) first_s_ = t_s;
      last_s_ = t_s;
    }
  }
  [[nodiscard]] Cycle cycle() const {
    return {high_ - low_, slips_ > 1 ? (slips_ - 1) / (last_s_ - first_s_) : 0};
  }

 private:
  double low_ = 1e9, high_ = -1e9, first_s_ = 0, last_s_ = 0;
  int slips_ = 0;
  bool armed_ = false;
};

enum class Method { midpoint, tr_bdf2 };

Cycle stick_slip(Method method, double stiffness_n_m, double h_s, double duration_s = 3) {
  const GlideLaw law = guide(stiffness_n_m);
  const LuGre lugre = cloth();
  GlideState state{.lag_m = {}, .room_mps = {0, -drive_mps}, .bristle = {}};
  CycleMeter meter;
  const int steps = static_cast<int>(duration_s / h_s);
  for (int i = 0; i < steps; ++i) {
    state = method == Method::midpoint
                ? glide_midpoint(law, lugre, state, {0, drive_mps}, h_s)
                : glide_tr_bdf2(law, lugre, lugre, lugre, state, {0, drive_mps}, h_s);
    if (i > steps / 2) meter.see(i * h_s, stiffness_n_m * state.lag_m[1], state.room_mps[1]);
  }
  return meter.cycle();
}

/// The same equations written again for Runge-Kutta of order 4, without any closed form.
Cycle runge_kutta(double stiffness_n_m, double h_s, double duration_s = 3) {
  const GlideLaw law = guide(stiffness_n_m);
  const LuGre lugre = cloth();
  using State = std::array<double, 3>;  // lag, velocity over the fabric, bristle
  const auto rates = [&](const State& y) {
    const double fall = y[1] / lugre.stribeck_mps;
    const double g = lugre.kinetic_n * (1 + (lugre.static_ratio - 1) * std::exp(-fall * fall));
    const double sigma0 = lugre.kinetic_n / lugre.length_m, z = y[2] * lugre.length_m;
    const double z_rate = y[1] - sigma0 * std::abs(y[1]) * z / g;
    const double friction = sigma0 * z + lugre.damping_n_s_m * z_rate;
    const double lag_rate = drive_mps - y[1];
    return State{lag_rate,
                 (law.stiffness_n_m * y[0] + law.damper_n_s_m * lag_rate - friction) / law.mass_kg,
                 z_rate / lugre.length_m};
  };
  const auto plus = [](const State& y, double h, const State& k) {
    return State{y[0] + h * k[0], y[1] + h * k[1], y[2] + h * k[2]};
  };
  State y{};
  CycleMeter meter;
  const int steps = static_cast<int>(duration_s / h_s);
  for (int i = 0; i < steps; ++i) {
    const State k1 = rates(y), k2 = rates(plus(y, h_s / 2, k1)), k3 = rates(plus(y, h_s / 2, k2)),
                k4 = rates(plus(y, h_s, k3));
    for (std::size_t j = 0; j < 3; ++j) y[j] += h_s / 6 * (k1[j] + 2 * k2[j] + 2 * k3[j] + k4[j]);
    if (i > steps / 2) meter.see(i * h_s, stiffness_n_m * y[0], y[1] - drive_mps);
  }
  return meter.cycle();
}

/// The closed form of the bristles at a constant slip: b = r n + (b_0 - r n) e^{-|w| t/(l r)}.
Vector2 relaxed(const Vector2& bristle, const Vector2& w_mps, double t_s, const LuGre& lugre) {
  const double speed = size(w_mps);
  if (!(speed > 0)) return bristle;
  const double r = lugre.limit_ratio(speed), full = r / speed;
  const double moved = -std::expm1(-speed * t_s / (lugre.length_m * r));
  return {bristle[0] + moved * (full * w_mps[0] - bristle[0]),
          bristle[1] + moved * (full * w_mps[1] - bristle[1])};
}

}  // namespace

TEST_CASE("bristles follow their closed form at any step, in pre-sliding and beyond") {
  LuGre lugre = cloth();
  for (const double speed : {1e-7, 1e-4, 2e-3, 0.05})
    for (const double path_m : {1e-9, 1e-6, 1e-5, 1e-3}) {
      const double ratio = 1 + 0.3 * std::exp(-std::pow(speed / lugre.stribeck_mps, 2));
      const double expected = -ratio * std::expm1(-path_m / (lugre.length_m * ratio));
      for (const int steps : {1, 2, 7, 1000}) {
        Vector2 bristle{};
        for (int i = 0; i < steps; ++i)
          bristle = bristle_after_slip(bristle, {0, speed}, path_m / speed / steps, lugre);
        CAPTURE(speed, path_m, steps);
        CHECK(std::abs(bristle[1] - expected) < 1e-14);
        CHECK(bristle[1] == Approx(expected).epsilon(1e-12));
        CHECK(bristle[0] == 0);
      }
    }
}

TEST_CASE("bristles turn with the slip and never leave the static limit") {
  const LuGre lugre = cloth();
  Vector2 bristle{};
  for (int i = 0; i < 2000; ++i) {
    const double angle = 0.05 * i, speed = 1e-4 * (1 + i % 50);
    bristle = bristle_after_slip(bristle, {speed * std::cos(angle), speed * std::sin(angle)}, 1e-3,
                                 lugre);
    REQUIRE(std::hypot(bristle[0], bristle[1]) <= lugre.static_ratio);
  }
  for (int i = 0; i < 100; ++i) bristle = bristle_after_slip(bristle, {3e-3, 4e-3}, 1e-3, lugre);
  CHECK(bristle[0] / bristle[1] == Approx(0.75).epsilon(1e-12));
}

TEST_CASE("steady sliding has the prescribed characteristic g(v) + sigma2 v") {
  LuGre lugre = cloth();
  lugre.viscous_n_s_m = 3;
  for (const double speed : {1e-5, 1e-3, 4e-3, 0.02}) {
    // A stiff slow guide imposes the speed; the spring's force then equals the friction.
    const GlideLaw law = guide(1e6, 1);
    GlideState a{.lag_m = {}, .room_mps = {0, -speed}, .bristle = {}}, b = a;
    const double h_s = std::min(5e-3, lugre.length_m / speed);
    for (int i = 0; i < 20000; ++i) {
      a = glide_midpoint(law, lugre, a, {0, speed}, h_s);
      b = glide_tr_bdf2(law, lugre, lugre, lugre, b, {0, speed}, h_s);
    }
    const double g = 1 + 0.3 * std::exp(-std::pow(speed / 5e-3, 2));
    CHECK(1e6 * a.lag_m[1] == Approx(g + 3 * speed).epsilon(1e-9));
    CHECK(1e6 * b.lag_m[1] == Approx(g + 3 * speed).epsilon(1e-9));
    CHECK(lugre.limit_ratio(speed) == Approx(g).epsilon(1e-14));
    CHECK(lugre.force_n(a.bristle, {0, speed})[1] == Approx(g + 3 * speed).epsilon(1e-9));
  }
}

TEST_CASE("the slip that is found balances the mean friction of its step") {
  LuGre lugre = cloth();
  lugre.viscous_n_s_m = 0.7;
  for (const double a : {1.0, 90.0, 2e3, 4e5})
    for (const double t_s : {1e-6, 2e-4, 5e-2})
      for (const double push : {1e-3, 0.8, 1.4, 30.0}) {
        const Vector2 bristle{0.4, -0.9}, q{push * 0.6, push * 0.8};
        const Vector2 w = solve_slip(lugre, BristleRule::exact, a, q, bristle, t_s, 1e-3).w_mps;
        // Mean of the bristles by Simpson's rule; the exponential of the product is a closed form.
        constexpr int pieces = 2000;
        Vector2 mean{};
        for (int i = 0; i <= pieces; ++i) {
          const Vector2 b = relaxed(bristle, w, t_s * i / pieces, lugre);
          const double weight = (i == 0 || i == pieces ? 1 : i % 2 == 1 ? 4 : 2) / (3.0 * pieces);
          for (std::size_t j = 0; j < 2; ++j) mean[j] += weight * b[j];
        }
        const Vector2 end = relaxed(bristle, w, t_s, lugre);
        for (std::size_t j = 0; j < 2; ++j) {
          const double rate = lugre.length_m * (end[j] - bristle[j]) / t_s;
          const double friction =
              lugre.kinetic_n * mean[j] + lugre.damping_n_s_m * rate + lugre.viscous_n_s_m * w[j];
          CAPTURE(a, t_s, push, j);
          CHECK(a * w[j] + friction == Approx(q[j]).margin(1e-7 * (1 + push)));
        }
      }
}

TEST_CASE("a steady load below the limit does not creep, at any step") {
  const LuGre lugre = cloth();
  const GlideLaw law{mass_kg, 1e-3, 0};  // a spring soft enough to have a constant force
  for (const double h_s : {1e-5, 2e-4, 1e-2}) {
    GlideState state{.lag_m = {0, 500}, .room_mps = {}, .bristle = {}};  // 0.5 N, half the limit
    const int steps = static_cast<int>(2 / h_s);
    for (int i = 0; i < steps; ++i) state = glide_midpoint(law, lugre, state, {}, h_s);
    const double settled = state.lag_m[1];
    for (int i = 0; i < steps; ++i) state = glide_midpoint(law, lugre, state, {}, h_s);
    CHECK(std::abs(state.lag_m[1] - settled) < 1e-11);  // 500 m of lag have an ulp of 6e-14 m
    CHECK(lugre.kinetic_n * state.bristle[1] == Approx(0.5).epsilon(1e-6));
  }
}

TEST_CASE("the known creep of LuGre under an oscillating load is the model's, not the step's") {
  const LuGre lugre = cloth();
  // Stages that shake the plate load the bristles between 0.3 and 0.7 of the limit.
  const auto creep_m = [&](double h_s) {
    const GlideLaw law = guide(1e4, 0.5);
    GlideState state{.lag_m = {0, 0.5e-4}, .room_mps = {}, .bristle = {0, 0.5}};
    double slipped_m = 0;
    const int steps = static_cast<int>(std::lround(10 / h_s));
    for (int i = 0; i < steps; ++i) {
      const double shake_mps = 0.2e-3 * std::sin(2 * std::numbers::pi * 5 * (i + 0.5) * h_s);
      const GlideState next = glide_midpoint(law, lugre, state, {0, shake_mps}, h_s);
      slipped_m += shake_mps * h_s - (next.lag_m[1] - state.lag_m[1]);
      state = next;
    }
    return slipped_m;
  };
  const double fine = creep_m(1e-4);
  CHECK(fine > 1e-6);
  CHECK(fine < 50 * 0.1 * lugre.length_m);  // 50 periods: less than a tenth of a length each
  CHECK(creep_m(1e-3) == Approx(fine).epsilon(0.02).margin(1e-8));
}

TEST_CASE("stick-slip at 1e4 N/m keeps amplitude and frequency at every step up to 1 ms") {
  const Cycle truth = runge_kutta(1e4, 1e-6);
  CHECK(truth.peak_to_peak_n == Approx(0.311).margin(0.002));
  CHECK(truth.frequency_hz == Approx(24.3).margin(0.2));
  for (const Method method : {Method::midpoint, Method::tr_bdf2})
    for (const auto& [h_s, tolerance] :
         {std::pair{1e-5, 3e-4}, {1e-4, 1e-3}, {2e-4, 2e-3}, {5e-4, 6e-3}, {1e-3, 0.02}}) {
      CAPTURE(method == Method::midpoint, h_s);
      const Cycle cycle = stick_slip(method, 1e4, h_s);
      CHECK(cycle.peak_to_peak_n == Approx(truth.peak_to_peak_n).epsilon(tolerance));
      CHECK(cycle.frequency_hz == Approx(truth.frequency_hz).epsilon(tolerance));
    }
}

TEST_CASE("stick-slip is stronger and slower on a soft guide, and absent on a stiff one") {
  const Cycle soft = runge_kutta(1e3, 1e-5, 6);
  CHECK(soft.peak_to_peak_n == Approx(0.538).margin(0.002));
  for (const Method method : {Method::midpoint, Method::tr_bdf2})
    for (const double h_s : {2e-4, 1e-3}) {
      const Cycle cycle = stick_slip(method, 1e3, h_s, 6);
      CHECK(cycle.peak_to_peak_n == Approx(soft.peak_to_peak_n).epsilon(2e-3));
      CHECK(cycle.frequency_hz == Approx(soft.frequency_hz).epsilon(2e-3));
      for (const double stiffness : {1e5, 1e6})
        CHECK(stick_slip(method, stiffness, h_s).peak_to_peak_n < 1e-4);
    }
}

TEST_CASE("without mass LuGre becomes Coulomb's stick-slip: 2 dF every 2 dF/(kV)") {
  const double k = 1e3, extra_n = 0.2;
  LuGre lugre{.kinetic_n = 1, .static_ratio = 1 + extra_n, .stribeck_mps = 1e-3, .length_m = 1e-7};
  double worst = 1;
  for (const double mass : {0.2, 2e-3}) {
    const GlideLaw law{mass, k, 0};
    lugre.damping_n_s_m = 2 * std::sqrt(mass / lugre.length_m);  // no ringing while sticking
    GlideState state{.lag_m = {}, .room_mps = {0, -1e-3}, .bristle = {}};
    CycleMeter meter;
    const double h_s = 0.02 * std::sqrt(mass / k);
    const int steps = static_cast<int>(3 / h_s);
    int slips = 0;
    double first = 0, last = 0;
    bool armed = false;
    for (int i = 0; i < steps; ++i) {
      state = glide_midpoint(law, lugre, state, {0, 1e-3}, h_s);
      const double t_s = i * h_s, force_n = k * state.lag_m[1];
      if (t_s > 1.3) meter.see(t_s, force_n, 0);
      if (force_n < 1 - 0.5 * extra_n) armed = t_s > 1.3;
      if (armed && force_n > 1 + 0.5 * extra_n) {
        armed = false;
        if (slips++ == 0) first = t_s;
        last = t_s;
      }
    }
    const double amplitude = meter.cycle().peak_to_peak_n / (2 * extra_n);
    const double period = (last - first) / (slips - 1) / (2 * extra_n / (k * 1e-3));
    const double error = std::max(std::abs(amplitude - 1), std::abs(period - 1));
    CAPTURE(mass, amplitude, period);
    CHECK(error < 0.3 * worst);
    worst = error;
  }
  CHECK(worst < 0.01);
}

TEST_CASE("off the cloth the guide swings for ever at any step, with its energy") {
  for (const auto& [h_omega, steps] :
       {std::pair{1e-3, 100000}, {0.05, 100000}, {0.1, 10000000}, {0.5, 100000}, {2.0, 100000}}) {
    const GlideLaw law{mass_kg, 1e4, 0};
    const double h_s = h_omega * std::sqrt(mass_kg / 1e4);
    GlideState state{.lag_m = {1e-4, -2e-4}, .room_mps = {}, .bristle = {}};
    const auto energy = [&] {
      double sum = 0;
      for (std::size_t j = 0; j < 2; ++j)
        sum += 0.5 * 1e4 * state.lag_m[j] * state.lag_m[j] +
               0.5 * mass_kg * state.room_mps[j] * state.room_mps[j];
      return sum;
    };
    const double at_first = energy();
    for (int i = 0; i < steps; ++i) state = glide_midpoint(law, {}, state, {0, 1e-3}, h_s);
    CAPTURE(h_omega, steps);
    CHECK(energy() == Approx(at_first).epsilon(1e-9));
  }
}

TEST_CASE("what a coarse step does not resolve TR-BDF2 brings to rest") {
  GlideState state{.lag_m = {0, 1e-4}, .room_mps = {}, .bristle = {}};
  for (int i = 0; i < 10; ++i)
    state = glide_tr_bdf2({mass_kg, 1e8, 0}, {}, {}, {}, state, {}, 0.05);
  CHECK(std::abs(state.lag_m[1]) < 1e-9);
  CHECK(std::abs(state.room_mps[1]) < 1e-5);
}

TEST_CASE("both methods are of second order over a slide that starts from rest") {
  const GlideLaw law = guide(1e4, 0.3);
  LuGre lugre = cloth();
  lugre.length_m = 150e-6;
  lugre.damping_n_s_m = 2 * 0.3 * std::sqrt(mass_kg / lugre.length_m);
  const auto lag_m = [&](Method method, int steps) {
    GlideState state;
    for (int i = 0; i < steps; ++i) {
      const double h_s = 0.1 / steps;
      state = method == Method::midpoint
                  ? glide_midpoint(law, lugre, state, {1e-3, drive_mps}, h_s)
                  : glide_tr_bdf2(law, lugre, lugre, lugre, state, {1e-3, drive_mps}, h_s);
    }
    return state.lag_m[1];
  };
  const double truth = lag_m(Method::midpoint, 200000);
  for (const Method method : {Method::midpoint, Method::tr_bdf2}) {
    const double coarse = std::abs(lag_m(method, 200) - truth);
    const double fine = std::abs(lag_m(method, 400) - truth);
    CAPTURE(method == Method::midpoint, coarse, fine);
    CHECK(std::log2(coarse / fine) == Approx(2).margin(0.15));
  }
}

}  // namespace lugre_test
