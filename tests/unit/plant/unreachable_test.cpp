// Positions and times that are not finite, at every level that moves a probe.

#include <catch2/catch.hpp>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "sim/plant/algebraic/algebraic_probe.hpp"
#include "tests/unit/plant/dynamic_support.hpp"

namespace unreachable_test {

using namespace weft;
using namespace weft::sim;
using namespace weft::sim::test;

namespace {

struct Law {
  std::string name;
  std::function<ContactState(const ContactState&, const Pose&, double)> step;
};

std::vector<Law> laws(const ContactMaterial& material) {
  std::vector<Law> all;
  const AlgebraicContact algebraic(level_plate(), material, 5);
  all.push_back({"L0", [=](const ContactState& from, const Pose& to, double) {
                   return algebraic.step(from, to);
                 }});
  const ContactModel statics(level_plate(), {}, material);
  all.push_back({"L1", [=](const ContactState& from, const Pose& to, double dt_s) {
                   return statics.step(from, to, dt_s);
                 }});
  for (const Integrator integrator : every) {
    const DynamicContact dynamic(level_plate(), {}, material, with_step(2e-4, integrator));
    all.push_back({name_of(integrator), [=](const ContactState& from, const Pose& to, double dt_s) {
                     return dynamic.step(from, to, dt_s);
                   }});
  }
  return all;
}

}  // namespace

TEST_CASE("poses that are not places and times that are not times change nothing, at any level") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  const ContactMaterial material = whole("terry");
  for (const Law& law : laws(material)) {
    const ContactState state = law.step(hanging(material, plate_z - 1e-3), {.z_m = plate_z}, 1e-3);
    REQUIRE(state.normal_n > 0);
    for (const double bad : {nan, inf, -inf, 1e308, -1e308, 1e4})
      for (int axis = 0; axis < 5; ++axis) {
        Pose pose = state.pose;
        double* const fields[] = {&pose.x_m, &pose.y_m, &pose.z_m, &pose.rx_rad, &pose.ry_rad};
        *fields[axis] = bad;
        CAPTURE(law.name, bad, axis);
        same_bits(law.step(state, pose, 0.01), state);
      }
    if (law.name == "L0") continue;  // has no time
    for (const double bad : {nan, inf, -inf, -1.0}) {
      CAPTURE(law.name, bad);
      same_bits(law.step(state, {.z_m = plate_z + 1e-4}, bad), state);
    }
  }
}

}  // namespace unreachable_test
