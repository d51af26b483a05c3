#pragma once
// The plan of an alignment, checked against the rig before anything moves.

#include <optional>
#include <vector>

#include "recipes/engine/rig_limits.hpp"

namespace weft::recipes {

/// Settings of an alignment; a missing optional is derived from the rig.
struct AlignSettings {
  unsigned per_side = 3;  ///< touches per side of a square grid, 2 to 9
  std::optional<double> span_m =
      {};  ///< side of the grid around the middle of the plate; 100 mm or less
  double contact_force_n = 0.1;       ///< force that counts as a touch
  double touch_speed_mps = 50e-6;     ///< speed of the measured touch
  double largest_residual_m = 20e-6;  ///< largest distance of a touch from the fitted plane
  double tolerance_rad = 100e-6;      ///< largest tilt that may remain
  std::optional<double> largest_tilt_rad = {};  ///< search limit; default: the rotary travel
};

struct AlignPlan {
  RigLimits limits;
  std::vector<Vec2> points_m;  ///< points to touch, on the nominal plate
  double reach_m = 0;          ///< from the middle of the grid to the furthest corner of the face
  double contact_force_n = 0;
  double approach_speed_mps = 2e-3;
  double touch_speed_mps = 0;
  double back_off_m = 0.2e-3;  ///< above the first contact, before the slow touch
  double transfer_speed_mps = 4e-3;
  double largest_residual_m = 0;
  double tolerance_rad = 0;
  double largest_tilt_rad = 0;
  double resolution_m = 1e-6;  ///< step of the z readings
  unsigned most_turns = 3;     ///< corrections before the alignment fails

  /// Largest distance of the surface from its nominal height within the reach [m].
  [[nodiscard]] double rise_m() const;
};

/// Errors: range, with the value that does not fit: a grid off the plate, too little z travel over
/// a plate tilted that far, a force at the cap or in the noise, a speed over the limit.
Result<AlignPlan> plan_alignment(const RigLimits& limits, const AlignSettings& settings);

}  // namespace weft::recipes
