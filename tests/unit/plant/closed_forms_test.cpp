// Closed forms (docs/reference/plant.md) that belong to no single mechanism, or that hold far
// better than the mechanism's own test requires. The whole list is there.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "sim/plant/dynamic/lugre.hpp"
#include "sim/plant/pads.hpp"
#include "sim/plant/stage.hpp"
#include "tests/unit/plant/dynamic_support.hpp"
#include "tests/unit/plant/support.hpp"

namespace closed_forms_test {

using namespace weft;
using namespace weft::sim;
using test::bristle_after_slip;
using test::level_plate;
using test::plate_z;

TEST_CASE("(3) under a rigid mount a jump of the stage relaxes by the Prony series, at any step") {
  ContactMaterial material = test::plain("pile");
  material.relaxation = {{0.2, 0.15}, {0.3, 5}};
  Mount rigid;
  rigid.stiffness_n_m = 1e10;  // 5 N move it by 1e-6 of this fabric's lambda
  rigid.slack_m = 0;
  const ContactModel model(level_plate(), rigid, material);
  const double top_n = level_plate().face_area_m2() * material.law.pressure_pa;
  const double depth_m = material.law.lambda_m * std::log1p(5 / top_n);
  const double z_m = plate_z - material.thickness_m + depth_m;
  for (const double dt_s : {1e-3, 0.027, 0.4, 12.0}) {
    ContactState state = model.step({}, {.z_m = z_m}, 0);
    CHECK(state.normal_n == Approx(5).epsilon(2e-6));
    const int steps = static_cast<int>(std::lround(12 / dt_s));
    for (int i = 0; i < steps; ++i) state = model.step(state, state.pose, dt_s);
    double expected = 5;
    for (std::size_t i = 0; i < Relaxation::terms; ++i)
      expected += 5 * material.relaxation.share[i] *
                  std::expm1(-steps * dt_s / material.relaxation.time_s[i]);
    CAPTURE(dt_s);
    CHECK(state.normal_n == Approx(expected).epsilon(2e-6));
  }
}

TEST_CASE("(5) one update of LuGre's bristles is the closed form to its rounding, at any step") {
  const LuGre lugre{.kinetic_n = 1, .static_ratio = 1.3, .stribeck_mps = 5e-3, .length_m = 10e-6};
  double worst = 0;
  for (const double speed : {1e-9, 1e-6, 2e-3, 4e-3, 0.3})
    for (const double t_s : {1e-9, 1e-6, 3e-4, 0.05, 1e3})
      for (const double from : {0.0, 0.7, -1.1}) {
        const long double v = speed, limit = 1 + (static_cast<long double>(1.3) - 1) *
                                                     std::exp(-(v / 5e-3L) * (v / 5e-3L));
        const long double keep = std::exp(-v * t_s / (static_cast<long double>(10e-6) * limit));
        const auto exact = static_cast<double>(limit + (from - limit) * keep);
        const double found = bristle_after_slip({0, from}, {0, speed}, t_s, lugre)[1];
        worst = std::max(worst, std::abs(found - exact));
      }
  CHECK(worst < 1e-15);
}

TEST_CASE("(9) a sinusoid's mean pressure is I0(a/lambda)") {
  Structure structure;
  structure.lines = {{.warp = 1, .weft = 0, .share = 1}};
  // Summed over equal steps of the pitch: exact except for the harmonics beyond them.
  for (const auto& [ratio, tolerance] :
       {std::pair{0.1, 1e-14}, {0.3, 1e-14}, {1.0, 1e-14}, {3.0, 1e-10}, {6.0, 2e-7}}) {
    const double lambda_m = 8e-6, amplitude_m = ratio * lambda_m;
    const HeightField field({1e-3, 1e-3, amplitude_m / std::numbers::sqrt2, structure}, 4);
    CAPTURE(ratio);
    CHECK(std::exp(field.log_mean_response(lambda_m)) ==
          Approx(std::cyl_bessel_i(0.0, ratio)).epsilon(tolerance));
  }
  CHECK(std::cyl_bessel_i(0.0, 0.3) == Approx(1.02).margin(0.005));  // Pads on a surface
  CHECK(std::cyl_bessel_i(0.0, 1.0) == Approx(1.27).margin(0.005));
}

TEST_CASE("(11) a pad is two plate capacitors in series") {
  const PadParams params;
  const double permittivity = 8.8541878128e-12, radius_m = 1e-3;
  const double plate = permittivity * std::numbers::pi * radius_m * radius_m;
  for (const double gap_m : {1e-9, 1e-6, 10e-6, 1e-3}) {
    const double sheet_f = plate * 3.5 / 100e-6, air_f = plate / gap_m;
    CHECK(capacitance_f(params, gap_m) ==
          Approx(sheet_f * air_f / (sheet_f + air_f)).epsilon(1e-13));
  }
  CHECK(capacitance_f(params, 0) == Approx(plate * 3.5 / 100e-6).epsilon(1e-14));
}

TEST_CASE("(14) a stage of 1 um in a proportional loop hunts by one quantum of force, K q") {
  constexpr double quantum_m = 1e-6, gain = 0.3;
  for (const double stiffness : {1e4, 1e5, 5e5})
    for (const double between : {0.1, 0.37, 0.5, 0.93}) {
      const double set_n = stiffness * (400 + between) * quantum_m;
      Stage stage({.low = 0, .high = 0.01, .start = 0, .quantum = quantum_m});
      double low = 1e9, high = -1e9;
      for (int cycle = 0; cycle < 600; ++cycle) {
        const TimePoint now{Duration(std::int64_t{27'027'027} * cycle)};
        const double force_n = stiffness * stage.carriage(now);
        const double error_m = (set_n - force_n) / stiffness;
        stage.move_to(stage.position(now) + gain * error_m, {0.1, 10}, now);
        if (cycle < 300) continue;
        low = std::min(low, force_n);
        high = std::max(high, force_n);
      }
      CAPTURE(stiffness, between);
      CHECK(high - low == Approx(stiffness * quantum_m).epsilon(1e-9));
      CHECK((low < set_n && set_n < high));
    }
}

}  // namespace closed_forms_test
