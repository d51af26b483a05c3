#pragma once
// Geometry of the 5-DoF workbench of Khan et al. 2016, section IV-A. The plate carries the fabric
// on x and y and turns about x. The probe is mounted on z and turns about y.
//
// Frames. World: X and Y horizontal, Z down, fixed to the bench; the untilted probe's face is at X
// = Y = 0. Fabric: u along the warp (x), v along the weft (y), h up from the surface of the plate.
// Its origin is the plate corner with the lowest x and y. With both tilts at zero
//     u = x_stage - x_origin,   v = y_stage - y_origin,   h = surface_z - z_stage.

#include <array>
#include <cstddef>
#include <string_view>

#include "protocols/base/result.hpp"

namespace weft::recipes {

enum class Axis : std::size_t { x, y, z, rx, ry };
inline constexpr std::size_t axis_count = 5;
inline constexpr std::array all_axes{Axis::x, Axis::y, Axis::z, Axis::rx, Axis::ry};

constexpr std::size_t index(Axis axis) {
  return static_cast<std::size_t>(axis);
}
constexpr bool is_linear(Axis axis) {
  return index(axis) <= index(Axis::z);
}
std::string_view to_string(Axis axis);

/// A point or displacement in the fabric frame [m]: x along the warp, y along the weft.
struct Vec2 {
  double x_m = 0;
  double y_m = 0;
  friend bool operator==(const Vec2&, const Vec2&) = default;
};

/// Closed interval, in the unit of the bounded value.
struct Range {
  double min = 0;
  double max = 0;
  [[nodiscard]] constexpr bool contains(double value) const { return value >= min && value <= max; }
  [[nodiscard]] constexpr double width() const { return max - min; }
};

/// Ends of travel may be reached exactly; sums of millimetres are not exact in binary [m or rad].
inline constexpr double travel_rounding = 1e-9;

/// Whether `inner` is in `outer`; its ends may exceed it by travel_rounding.
constexpr bool within(const Range& outer, const Range& inner) {
  return inner.min >= outer.min - travel_rounding && inner.max <= outer.max + travel_rounding;
}

/// Stage positions: metres for x, y, z (z counts downwards, to the fabric), radians for rx, ry.
struct Joints {
  std::array<double, axis_count> value{};
  [[nodiscard]] constexpr double operator[](Axis axis) const { return value[index(axis)]; }
  constexpr double& operator[](Axis axis) { return value[index(axis)]; }
};

/// Angles of the two rotary stages.
struct Tilts {
  double rx_rad = 0;
  double ry_rad = 0;
};

/// Pose of the probe's face relative to the fabric.
struct ProbePose {
  Vec2 contact_m;  ///< foot of the face's centre on the plate, fabric frame
  double clearance_m =
      0;  ///< height of the face's centre above the surface of the plate; < 0 is below it
  double tilt_x_rad = 0;  ///< angle of the probe's axis from the plate's normal, about the warp
  double tilt_y_rad = 0;  ///< the same about the weft
};

/// Constant lengths of the bench.
struct Geometry {
  std::array<Range, axis_count> travel{};  ///< [m] or [rad]
  /// Axes without a stage; both ends of their travel are their fixed position.
  std::array<bool, axis_count> fixed{};
  Vec2 origin_m;           ///< x and y stage positions that put the probe over the fabric's origin
  Vec2 plate_size_m;       ///< the plate covers [0, size] in the fabric frame
  double surface_z_m = 0;  ///< z stage position at which the face would touch the bare plate
  double tilt_axis_y_m = 0;      ///< v of the axis about which the plate turns
  double tilt_axis_depth_m = 0;  ///< depth of that axis below the surface of the plate
  double probe_arm_m = 0;        ///< from the axis about which the probe turns down to its face

  [[nodiscard]] bool is_fixed(Axis axis) const { return fixed[index(axis)]; }
};

/// Exact forward kinematics; any finite joints have a pose.
ProbePose forward(const Geometry& geometry, const Joints& joints);

/// Exact inverse. Errors: range when stages would leave their travel by more than travel_rounding
/// (the error names all of them); invalid_argument when the pose is not finite or leans a quarter
/// turn or more.
Result<Joints> inverse(const Geometry& geometry, const ProbePose& pose);

/// Angle between the probe's axis and the plate's normal [rad], 0 to pi.
double lean_rad(const ProbePose& pose);

// The bench relative to a surface: stage positions to and from a point and a normal, both in the
// fabric frame. The face of the probe is at the point and its axis is along the normal. Two
// rotations fix a direction but no turn about it. Therefore five stage positions and a point with a
// normal determine each other.

/// A direction in the fabric frame: along the warp, along the weft, up from the plate. Any length
/// except zero.
struct Direction {
  double u = 0;
  double v = 0;
  double up = 1;
};

/// The probe's axis, as a unit vector away from the plate, with the rotary stages at `tilts`.
Direction probe_axis(const Tilts& tilts);

/// Angles of the rotary stages that align the probe's axis with `normal`. Closed form:
///     rx = atan2(v, up),   ry = atan2(-u, hypot(v, up)).
/// Errors: invalid_argument when `normal` is not finite or zero, does not point away from the plate
/// (a quarter turn or more), or is along the warp, where rx is undetermined (singularity).
Result<Tilts> tilts_along(const Direction& normal);

/// Angle between two directions [rad], 0 to pi, to full precision near 0 too.
double angle_between(const Direction& a, const Direction& b);

/// The probe on a surface, in the fabric frame.
struct SurfacePose {
  Vec2 contact_m;          ///< foot of the face's centre on the nominal plate
  double clearance_m = 0;  ///< height of the face's centre above the nominal plate
  Direction normal;        ///< along the probe's axis, away from the plate
};

/// Forward kinematics. Errors: invalid_argument for joints that are not finite or lean a quarter
/// turn or more.
Result<SurfacePose> surface_pose(const Geometry& geometry, const Joints& joints);

/// Inverse kinematics. Errors: those of tilts_along() and of inverse(): range when a stage would
/// leave its travel.
Result<Joints> joints_on(const Geometry& geometry, const SurfacePose& pose);

}  // namespace weft::recipes
