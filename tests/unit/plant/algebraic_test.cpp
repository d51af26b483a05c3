#include "sim/plant/algebraic/algebraic_probe.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <numbers>

#include "tests/unit/plant/support.hpp"

namespace algebraic_test {

using namespace weft;
using namespace weft::sim;
using test::level_plate;
using test::plain;
using test::plate_z;

namespace {

constexpr double set_n = 5;

HeightField ripple(double amplitude_m, double pitch_m) {
  Structure structure;
  structure.lines = {{.warp = 1, .weft = 0, .share = 1}};
  return HeightField({pitch_m, pitch_m, amplitude_m / std::sqrt(2.0), structure}, 4);
}

/// Half the range of the height under the pad along ten pitches.
double seen_amplitude_m(LinearTexture texture, double pitch_m) {
  double low = 1, high = -1;
  TextureMap::Cursor cursor;
  for (int i = 0; i < 4000; ++i) {
    const double height = texture.height_m(10 * pitch_m * i / 4000, 0.3e-3, cursor);
    low = std::min(low, height);
    high = std::max(high, height);
  }
  return 0.5 * (high - low);
}

}  // namespace

TEST_CASE(
    "at level L0 the force is the set-point from touch on, at the closed form's indentation") {
  const ContactMaterial material = plain("denim");
  const AlgebraicContact contact(level_plate(), material, set_n);
  const double touch = plate_z - material.thickness_m;
  CHECK(contact.step({}, {.z_m = touch - 1e-9}).normal_n == 0);
  for (const double depth : {0.0, 1e-6, 3e-3}) {
    const ContactState state = contact.step({}, {.z_m = touch + depth});
    CHECK(state.normal_n == set_n);
    const double top_n = level_plate().face_area_m2() * material.law.pressure_pa;
    CHECK(state.indentation_m ==
          Approx(material.law.lambda_m * std::log1p(set_n / top_n)).epsilon(1e-14));
    CHECK(contact.pressure_pa(state, 2e-3, -2e-3, 0) ==
          Approx(set_n / level_plate().face_area_m2()).epsilon(1e-12));
  }
  CHECK(contact.step({}, {.z_m = std::nan("")}).normal_n == 0);
}

TEST_CASE("friction is mu N along the motion, and stays there while the probe is at rest") {
  const ContactMaterial material = test::patch_of(test::library(), "terry", 1).material;
  const AlgebraicContact contact(level_plate(), material, set_n);
  ContactState state = contact.step({}, {.z_m = plate_z});
  CHECK(state.friction_n == Vector2{});
  state = contact.step(state, {.x_m = 3e-6, .y_m = 4e-6, .z_m = plate_z});
  const double expected = material.friction.sliding_n(set_n);
  CHECK(state.friction_n[0] == Approx(0.6 * expected));
  CHECK(state.friction_n[1] == Approx(0.8 * expected));
  CHECK(contact.step(state, state.pose).friction_n == state.friction_n);
}

TEST_CASE("a pad of level L0 is the disc's linear filter at any height of the ripple") {
  for (const double pitch : {1.0e-3, 1.81e-3, 4e-3})
    for (const double amplitude : {0.5e-6, 50e-6}) {
      CAPTURE(pitch, amplitude);
      const double x = std::numbers::pi * 2e-3 / pitch;
      const double jinc = 2 * std::cyl_bessel_j(1.0, x) / x;
      // 0.7 % of full scale for the disc's square cells.
      CHECK(seen_amplitude_m(LinearTexture(ripple(amplitude, pitch)), pitch) / amplitude ==
            Approx(std::abs(jinc)).margin(0.007));
    }
}

TEST_CASE("on a faint texture levels L0 and L1 press the pads alike, on a strong one they do not") {
  const ContactMaterial material = plain("denim");
  const double pitch = 4e-3, touch = plate_z - material.thickness_m;
  for (const double share : {0.02, 2.0}) {
    const HeightField field = ripple(share * material.law.lambda_m, pitch);
    LinearTexture linear(field);
    TextureMap exponential(field, material.law.lambda_m);
    TextureMap::Cursor a, b;
    const ContactModel quasistatic(level_plate(), {}, material);
    ContactState l1 = quasistatic.step({}, {.z_m = touch - 1e-3}, 0);
    while (l1.normal_n < set_n) l1 = quasistatic.step(l1, {.z_m = l1.pose.z_m + 1e-7}, 0.01);
    const AlgebraicContact contact(level_plate(), material, set_n);
    const ContactState l0 = contact.step({}, {.z_m = touch});
    double worst = 0;
    for (int i = 0; i < 100; ++i) {
      const double x = pitch * i / 100;
      const double flat = contact.pressure_pa(l0, 0, 0, linear.height_m(x, 0, a));
      const double true_pa = quasistatic.pressure_pa(l1, 0, 0, exponential.response(x, 0, b));
      worst = std::max(worst, std::abs(flat / true_pa - 1));
    }
    CAPTURE(share, worst);
    CHECK((worst < 0.002) == (share < 0.1));
    CHECK(worst < 10);
  }
}

}  // namespace algebraic_test
