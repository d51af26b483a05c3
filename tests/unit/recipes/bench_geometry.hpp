#pragma once
// A bench with both rotary stages away from the plate's corner, for the tests of the kinematics.

#include <random>

#include "recipes/kinematics/kinematics.hpp"

namespace weft::recipes::test {

inline Geometry bench_geometry() {
  Geometry g;
  g.travel = {Range{0, 0.15}, {0, 0.15}, {0, 0.15}, {-0.3, 0.3}, {-0.3, 0.3}};
  g.origin_m = {0.01, 0.02};
  g.plate_size_m = {0.12, 0.12};
  g.surface_z_m = 0.1;
  g.tilt_axis_y_m = 0.06;
  g.tilt_axis_depth_m = 0.015;
  g.probe_arm_m = 0.05;
  return g;
}

/// A random position in the travel of the bench.
template <class Random>
Joints joints_anywhere(const Geometry& g, Random& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  Joints joints;
  for (const Axis axis : all_axes) {
    const Range& r = g.travel[index(axis)];
    joints[axis] = r.min + (0.001 + 0.998 * unit(random)) * r.width();
  }
  return joints;
}

}  // namespace weft::recipes::test
