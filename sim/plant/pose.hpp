#pragma once
// Where the stages are, in the fabric's terms. Frames: sim/README.md.

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

}  // namespace weft::sim
