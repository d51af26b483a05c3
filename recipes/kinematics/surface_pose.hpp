#pragma once
// The bench seen from a surface: stage positions to and from a point and a normal, both in the
// fabric frame. The probe stands on the point with its axis along the normal. Two rotations fix a
// direction but no turn about it, so the five stages and a point with a normal determine each
// other.

#include "recipes/kinematics/kinematics.hpp"

namespace weft::recipes {

/// A direction in the fabric frame: along the warp, along the weft, up from the plate. Any length
/// but zero.
struct Direction {
  double u = 0;
  double v = 0;
  double up = 1;
};

struct SurfacePose {
  Vec2 contact_m;          ///< foot of the face's centre on the nominal plate
  double clearance_m = 0;  ///< height of the face's centre above the nominal plate
  Direction normal;        ///< along the probe's axis, away from the plate
};

/// The probe's axis, as a unit vector away from the plate, with the rotary stages at `tilts`.
Direction probe_axis(const Tilts& tilts);

/// Where the rotary stages put the probe's axis along `normal`. Closed form:
///     rx = atan2(v, up),   ry = atan2(-u, hypot(v, up)).
/// Errors: invalid_argument when `normal` is not finite or zero, does not point away from the plate
/// (a quarter turn or more), or lies along the warp, where rx is not determined (the singularity).
Result<Tilts> tilts_along(const Direction& normal);

/// Angle between two directions [rad], 0 to pi, to full precision near 0 too.
double angle_between(const Direction& a, const Direction& b);

/// Forward. Errors: invalid_argument for joints that are not finite or lean a quarter turn or more.
Result<SurfacePose> surface_pose(const Geometry& geometry, const Joints& joints);

/// Inverse. Errors: those of tilts_along() and of inverse(): range when a stage would leave its
/// travel.
Result<Joints> joints_on(const Geometry& geometry, const SurfacePose& pose);

}  // namespace weft::recipes
