#pragma once
// Where the stages are, in the fabric's terms. Frames: sim/README.md.

#include <cmath>

#include "protocols/base/time.hpp"

namespace weft::sim {

/// The probe's mount. The probe rides in a guide on the z stage: it can be pushed up against a
/// spring (the sensor's and mount's compliance), rests freely inside a slack, and hangs on a stop
/// below it. Inside the slack the stage does nothing to the force: the cloth carries the probe's
/// own weight, which is phase S of Khan et al. 2016.
struct Mount {
  double mass_kg = 0.2;             ///< [E]
  double stiffness_n_m = 2e4;       ///< k_c, series compliance [E]
  double slack_m = 0.5e-3;          ///< [E]
  double stop_stiffness_n_m = 2e5;  ///< of the stop the probe hangs on [E]

  [[nodiscard]] double weight_n() const { return mass_kg * standard_gravity_mps2; }

  /// Force of the mount on the probe, downwards, at `extension_m` = z_stage - z_probe.
  [[nodiscard]] double force_n(double extension_m) const {
    if (extension_m > 0) return stiffness_n_m * extension_m;
    if (extension_m >= -slack_m) return 0;
    return stop_stiffness_n_m * (extension_m + slack_m);
  }
  [[nodiscard]] double slope_n_m(double extension_m) const {
    if (extension_m > 0) return stiffness_n_m;
    return extension_m >= -slack_m ? 0 : stop_stiffness_n_m;
  }
  /// Extension of a probe that hangs free.
  [[nodiscard]] double hanging_extension_m() const {
    return -slack_m - weight_n() / stop_stiffness_n_m;
  }
};

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
