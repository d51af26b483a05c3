#pragma once
// What an alignment will do, checked against the rig before anything moves.

#include <optional>
#include <vector>

#include "recipes/engine/rig_limits.hpp"

namespace weft::recipes {

/// What a person may choose; what is left out follows from the rig.
struct AlignSettings {
  unsigned per_side = 3;  ///< touches on a square grid, 2 to 9 a side
  std::optional<double> span_m =
      {};                          ///< side of the grid, around the plate's middle; 100 mm or less
  double contact_force_n = 0.1;    ///< that counts as a touch
  double touch_speed_mps = 50e-6;  ///< of the touch that is measured
  double largest_residual_m = 20e-6;            ///< a surface further from its plane is not a plane
  double tolerance_rad = 100e-6;                ///< tilt that may be left
  std::optional<double> largest_tilt_rad = {};  ///< looked for; the rotary travel when left out
};

struct AlignPlan {
  RigLimits limits;
  std::vector<Vec2> points_m;  ///< where the probe touches, on the nominal plate
  double reach_m = 0;          ///< from the grid's middle to the furthest corner of the face
  double contact_force_n = 0;
  double approach_speed_mps = 2e-3;
  double touch_speed_mps = 0;
  double back_off_m = 0.2e-3;  ///< above the first contact, for the slow touch
  double transfer_speed_mps = 4e-3;
  double largest_residual_m = 0;
  double tolerance_rad = 0;
  double largest_tilt_rad = 0;
  double resolution_m = 1e-6;  ///< step in which z is read
  unsigned most_turns = 3;     ///< corrections before it is given up

  /// How far the surface may lie over or under its nominal height within the reach [m].
  [[nodiscard]] double rise_m() const;
};

/// Errors: range, naming what does not fit: a grid off the plate, no room in z over a plate so
/// tilted, a force at the cap or in the noise, a speed over the limit.
Result<AlignPlan> plan_alignment(const RigLimits& limits, const AlignSettings& settings);

}  // namespace weft::recipes
