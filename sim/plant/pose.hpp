#pragma once
// Where the stages are, in the fabric's terms. Frames: sim/README.md.

#include <cmath>

namespace weft::sim {

/// All five axes of the bench at one instant.
struct Pose {
  double x_m = 0;  ///< fabric frame: centre of the probe's face
  double y_m = 0;
  double z_m = 0;     ///< z stage, downwards, from its home
  double rx_rad = 0;  ///< plate about the fabric frame's x axis; > 0 raises the plate at larger y
  double ry_rad = 0;  ///< probe about the fabric frame's y axis; > 0 raises the face at larger x

  friend bool operator==(const Pose&, const Pose&) = default;
};

/// False for what no stage can reach: NaN, infinity, beyond 1 km or 1000 rad. Models stay where
/// they are instead of going there.
inline bool reachable(const Pose& pose) {
  const auto near = [](double x) { return std::abs(x) <= 1e3; };
  return near(pose.x_m) && near(pose.y_m) && near(pose.z_m) && near(pose.rx_rad) &&
         near(pose.ry_rad);
}

/// The pose after `share` of the straight way from `a` to `b`.
constexpr Pose between(const Pose& a, const Pose& b, double share) {
  const auto on_way = [share](double from, double to) { return from + share * (to - from); };
  return {.x_m = on_way(a.x_m, b.x_m),
          .y_m = on_way(a.y_m, b.y_m),
          .z_m = on_way(a.z_m, b.z_m),
          .rx_rad = on_way(a.rx_rad, b.rx_rad),
          .ry_rad = on_way(a.ry_rad, b.ry_rad)};
}

}  // namespace weft::sim
