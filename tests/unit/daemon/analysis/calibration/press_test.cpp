// Forces of the plant from recorded levels and the ratio of recorded forces.

#include <catch2/catch.hpp>
#include <cmath>

#include "daemon/analysis/calibration/press.hpp"
#include "sim/plant/contact.hpp"
#include "tests/unit/daemon/analysis/calibration/strokes.hpp"

namespace weft::daemon::calibration::press_test {
namespace {

const sim::PadParams pads;

Stroke pressed(double level, double force_n = NAN, double rest_force_n = NAN) {
  Stroke out = test::stroke("denim", 0, 2, 20, [&](auto, auto) { return level; });
  out.force_n = force_n;
  out.rest_force_n = rest_force_n;
  return out;
}

Press planned(const Stroke& stroke, double scale = 1) {
  const Stroke* const one = &stroke;
  return plan_press(std::span(&one, 1), pads, scale);
}

double counts_at(double force_n) {
  return counts_under(pads, force_n / sim::ContactGeometry{}.face_area_m2());
}

}  // namespace

TEST_CASE("Pressure and counts of an even pad are inverse to each other") {
  for (const double pressure_pa : {100.0, 5e3, 2e4, 1e5})
    CHECK(pressure_for(pads, counts_under(pads, pressure_pa)) == Approx(pressure_pa).epsilon(1e-6));
  CHECK(counts_under(pads, 0) == 0);
  CHECK(std::isfinite(pressure_for(pads, 1e9)));  // more than a closed pad has
}

TEST_CASE("Without a wrench, or without load at rest, the level decides the force") {
  const Press plain = planned(pressed(300));
  CHECK(counts_at(plain.force_n[0]) == Approx(300));
  CHECK(counts_at(plain.rest_n) < 3);
  for (const Stroke& stroke :
       {pressed(300, 4), pressed(300, 4, 0), pressed(300, 4, -1), pressed(300, NAN, 2)}) {
    CHECK(rest_ratio(stroke) == 0);
    CHECK(planned(stroke).force_n == plain.force_n);
    CHECK(planned(stroke).rest_n == plain.rest_n);
  }
}

TEST_CASE("With a wrench the ratio of forces is kept, and the gain does not matter") {
  for (const double ratio : {0.05, 0.3}) {
    const Press press = planned(pressed(100, 4, 4 * ratio));
    CHECK(press.rest_n / press.force_n[0] == Approx(ratio));
    CHECK(counts_at(press.force_n[0]) - counts_at(press.rest_n) == Approx(100));
    CHECK(planned(pressed(100, 40, 40 * ratio)).force_n[0] == Approx(press.force_n[0]));
    CHECK(planned(pressed(700, 4, 4 * ratio), 7).force_n[0] == Approx(press.force_n[0]));
  }
  CHECK(rest_ratio(pressed(300, 4, 8)) == 0.9);
}

TEST_CASE("A level that no force gives above a load at rest is scaled") {
  const RecordingView plain = test::view_of({pressed(300)});
  CHECK(count_scale(plain, pads) == 1);
  const Stroke heavy = pressed(300, 4, 3.9);
  const double scale = count_scale(test::view_of({heavy}), pads);
  CHECK(scale > 1);
  const Press press = planned(heavy, scale);
  CHECK(counts_at(press.force_n[0]) - counts_at(press.rest_n) == Approx(300 / scale));
  CHECK(press.rest_n / press.force_n[0] == Approx(0.9));
}

TEST_CASE("The load at rest is one for all strokes of a mounting") {
  const Stroke light = pressed(50, 2, 0.4), strong = pressed(100, 4, 0.4);
  const std::array<const Stroke*, 2> both{&light, &strong};
  const Press press = plan_press(both, pads, 1);
  CHECK(counts_at(press.force_n[0]) - counts_at(press.rest_n) == Approx(50));
  CHECK(counts_at(press.force_n[1]) - counts_at(press.rest_n) == Approx(100));
}

}  // namespace weft::daemon::calibration::press_test
