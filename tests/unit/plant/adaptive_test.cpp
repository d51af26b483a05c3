// Level L2 with substeps that follow the motion: short while the probe swings, longer while it is
// calm.

#include <limits>
#include <vector>

#include "tests/unit/plant/dynamic_support.hpp"

namespace adaptive_test {

using namespace weft;
using namespace weft::sim;
using namespace weft::sim::test;

namespace {

constexpr double grid_s = 3.072e-3, fine_s = 96e-6;
constexpr double longest = 16;  // times the short substep

DynamicContact contact_of(const ContactMaterial& material, double step_s, Integrator integrator) {
  return {level_plate(), {}, material, with_step(step_s, integrator)};
}

/// Pressed to rest, with a still stage.
ContactState at_rest(const ContactMaterial& material) {
  const DynamicContact contact = contact_of(material, fine_s, Integrator::midpoint);
  const double end_m = plate_z - material.thickness_m + 6 * material.law.lambda_m;
  ContactState state = hanging(material, end_m - 1e-3);
  for (int i = 1; i <= 400; ++i)
    state = contact.step(state, {.z_m = end_m - 1e-3 * (1 - i / 400.0)}, grid_s);
  for (int i = 0; i < 3000; ++i) state = contact.step(state, state.pose, grid_s);
  return state;
}

/// Down, to rest, and 20 mm along the fabric. The stage is on whole micrometres in z that wander as
/// under a force loop.
std::vector<Pose> press_and_slide(const ContactMaterial& material) {
  std::vector<Pose> path;
  const double end_m = plate_z - material.thickness_m + 7 * material.law.lambda_m + 0.1e-3;
  double z_m = end_m - 1.5e-3, y_m = 0;
  for (int i = 0; i < 4000; ++i) {
    if (z_m < end_m) z_m += 1e-3 * grid_s;
    if (i > 1200) y_m += 2e-3 * grid_s;
    const double wander_m = i > 1200 ? 1.5e-6 * std::sin(0.05 * i) : 0;
    path.push_back({.y_m = y_m, .z_m = 1e-6 * std::round((z_m + wander_m) * 1e6)});
  }
  return path;
}

std::vector<double> forces_n(const ContactMaterial& material, double step_s,
                             Integrator integrator) {
  const DynamicContact contact = contact_of(material, step_s, integrator);
  const std::vector<Pose> path = press_and_slide(material);
  ContactState state = hanging(material, path.front().z_m);
  std::vector<double> out;
  for (const Pose& pose : path) {
    state = contact.step(state, pose, grid_s);
    out.push_back(state.normal_n);
  }
  return out;
}

double rms_n(const std::vector<double>& a, const std::vector<double>& b) {
  double squares = 0;
  for (std::size_t i = 0; i < a.size(); ++i) squares += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(squares / static_cast<double>(a.size()));
}

}  // namespace

TEST_CASE("a probe at rest takes the longest substeps, bit for bit those of the equal method") {
  // On the softest fabric, starting at a quarter of the short step: a swing would need resolution.
  const double short_s = fine_s / 4;
  const ContactMaterial material = plain("terry");
  const ContactState rest = at_rest(material);
  REQUIRE(rest.normal_n > 0.5);
  REQUIRE(std::abs(rest.velocity_mps[2]) < 1e-8);
  const DynamicContact adaptive = contact_of(material, short_s, Integrator::adaptive);
  const DynamicContact coarse = contact_of(material, longest * short_s, Integrator::midpoint);
  const DynamicContact equal = contact_of(material, short_s, Integrator::midpoint);
  ContactState a = rest, b = rest, c = rest;
  Pose to = rest.pose;
  to.z_m += 1e-9;  // so that there is a motion
  for (int i = 0; i < 3; ++i) {
    a = adaptive.step(a, to, longest * short_s);
    b = coarse.step(b, to, longest * short_s);
    c = equal.step(c, to, longest * short_s);
  }
  same_bits(a, b);
  CHECK(a.velocity_mps != c.velocity_mps);
}

TEST_CASE("a probe that swings, flies or lands takes the short substeps, bit for bit") {
  const ContactMaterial material = plain("denim");
  const DynamicContact adaptive = contact_of(material, fine_s, Integrator::adaptive);
  const DynamicContact equal = contact_of(material, fine_s, Integrator::midpoint);
  ContactState swings = at_rest(material);
  swings.velocity_mps[2] = 0.02;
  ContactState slips = at_rest(material);
  slips.velocity_mps[1] = 0.05;
  ContactState flies;
  flies.pose.z_m = plate_z - material.thickness_m - 1e-3;
  flies.extension_m = -0.25e-3;  // in the middle of the slack
  ContactState lands = hanging(material, plate_z - material.thickness_m - 0.51e-3);
  lands.velocity_mps[2] = 4e-3;
  for (const ContactState& from : {swings, slips, flies, lands}) {
    Pose to = from.pose;
    to.z_m += 4e-6;
    same_bits(adaptive.step(from, to, longest * fine_s), equal.step(from, to, longest * fine_s));
  }
}

TEST_CASE("longer substeps in the calm cost little of the force") {
  for (const char* name : {"denim", "satin", "nylon", "wool"}) {
    const ContactMaterial material = whole(name);
    const std::vector<double> truth = forces_n(material, 6e-6, Integrator::midpoint);
    REQUIRE(truth.back() > 1);
    const double adaptive_n = rms_n(forces_n(material, fine_s, Integrator::adaptive), truth);
    const double twice_n = rms_n(forces_n(material, 2 * fine_s, Integrator::midpoint), truth);
    CAPTURE(name, adaptive_n, twice_n);
    CHECK(adaptive_n < twice_n);  // of equal substeps of twice the length
    CHECK(adaptive_n < 3e-3);
    const double finer_n = rms_n(forces_n(material, fine_s / 4, Integrator::adaptive), truth);
    CHECK(finer_n < adaptive_n / 8);
  }
}

TEST_CASE("a minute of calm on a stiff cloth keeps the force: no swing is left unresolved") {
  // The waves of the fabric make the probe swing at every conversion, and hysteresis keeps the
  // effects.
  for (const char* name : {"satin", "nylon"}) {
    const ContactMaterial material = whole(name);
    const double end_m = plate_z - material.thickness_m + 7.5 * material.law.lambda_m + 0.15e-3;
    const DynamicContact adaptive = contact_of(material, fine_s, Integrator::adaptive);
    const DynamicContact equal = contact_of(material, fine_s, Integrator::midpoint);
    ContactState a = hanging(material, end_m - 1e-3), b = a;
    double worst_n = 0;
    for (int i = 1; i <= 16'000; ++i) {
      const Pose pose{.x_m = 0.03,
                      .y_m = 4e-3 * grid_s * std::max(0, i - 1000),
                      .z_m = end_m - 1e-3 * std::max(0.0, 1 - i / 400.0)};
      a = adaptive.step(a, pose, grid_s);
      b = equal.step(b, pose, grid_s);
      if (i > 1000) worst_n = std::max(worst_n, std::abs(a.normal_n - b.normal_n));
    }
    CAPTURE(name, worst_n);
    REQUIRE(b.normal_n > 3);
    CHECK(worst_n < 1e-3);
  }
}

TEST_CASE("a velocity that is not a number along any axis is stepped as by equal substeps") {
  const ContactMaterial material = plain("denim");
  const DynamicContact adaptive = contact_of(material, fine_s, Integrator::adaptive);
  const DynamicContact equal = contact_of(material, fine_s, Integrator::midpoint);
  for (const std::size_t axis : {0, 1, 2}) {
    ContactState state = at_rest(material);
    state.velocity_mps[axis] = std::numeric_limits<double>::quiet_NaN();
    Pose to = state.pose;
    to.z_m += 1e-6;
    const ContactState a = adaptive.step(state, to, grid_s), b = equal.step(state, to, grid_s);
    for (const std::size_t i : {0, 1, 2}) {
      CAPTURE(axis, i);
      if (std::isnan(b.velocity_mps[i]))
        CHECK(std::isnan(a.velocity_mps[i]));
      else
        CHECK(a.velocity_mps[i] == b.velocity_mps[i]);
    }
  }
}

}  // namespace adaptive_test
