#pragma once
// Least-squares plane through the points where the probe touched, with the uncertainty of its
// slopes from the residuals.

#include <cstddef>
#include <span>

#include "recipes/kinematics/kinematics.hpp"

namespace weft::recipes {

/// The face's centre at a touch, fabric frame [m].
struct TouchPoint {
  Vec2 contact_m;
  double height_m = 0;  ///< above the nominal plate
};

/// height = height_m + slope_x (x - centre.x) + slope_y (y - centre.y)
struct PlaneFit {
  Vec2 centre_m;  ///< mean of the points
  double height_m = 0;
  double slope_x = 0;  ///< rise per metre along the warp
  double slope_y = 0;  ///< along the weft
  double slope_x_sd = 0;
  double slope_y_sd = 0;  ///< standard deviations of the slopes, nearly those of the angles [rad]
  double residual_rms_m = 0;    ///< over points - 3 degrees of freedom; 0 for three points
  double residual_worst_m = 0;  ///< greatest magnitude
  std::size_t points = 0;

  [[nodiscard]] double height_at(Vec2 point_m) const {
    return height_m + slope_x * (point_m.x_m - centre_m.x_m) +
           slope_y * (point_m.y_m - centre_m.y_m);
  }
  /// Points away from the plate.
  [[nodiscard]] Direction normal() const { return {-slope_x, -slope_y, 1}; }
};

/// `resolution_m` >= 0 is the step of the height readings. The standard deviation of one touch is
/// that of the residuals, but at least that of the step, resolution / sqrt 12. With three points,
/// or points that happen to agree, only the step counts.
/// Errors: invalid_argument for fewer than three points, points on a line (narrower than a
/// thousandth of their length) and values that are not finite.
Result<PlaneFit> fit_plane(std::span<const TouchPoint> points, double resolution_m);

}  // namespace weft::recipes
