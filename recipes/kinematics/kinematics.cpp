#include "recipes/kinematics/kinematics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace weft::recipes {
namespace {

constexpr double quarter_turn = std::numbers::pi / 2;

/// Rotation in a plane by `angle`, counter-clockwise: (a, b) -> (c a - s b, s a + c b).
std::array<double, 2> turned(double a, double b, double angle) {
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  return {c * a - s * b, s * a + c * b};
}

bool finite(const ProbePose& pose) {
  return std::isfinite(pose.contact_m.x_m) && std::isfinite(pose.contact_m.y_m) &&
         std::isfinite(pose.clearance_m) && std::isfinite(pose.tilt_x_rad) &&
         std::isfinite(pose.tilt_y_rad);
}

tl::unexpected<Error> unusable(const char* what, const char* expected) {
  return fail(
      {.code = Errc::invalid_argument, .where = "kinematics", .what = what, .expected = expected});
}

std::string unit_of(Axis axis) {
  return is_linear(axis) ? " m" : " rad";
}

/// "x = 0.2 m outside 0 to 0.15 m; ..." for every stage that cannot reach its position.
std::string unreachable(const Geometry& geometry, const Joints& joints) {
  std::string list;
  for (const Axis axis : all_axes) {
    const Range& range = geometry.travel[index(axis)];
    if (within(range, {joints[axis], joints[axis]})) continue;
    list += (list.empty() ? "" : "; ") + std::string(to_string(axis)) + " = " +
            std::to_string(joints[axis]) + unit_of(axis) + " outside " + std::to_string(range.min) +
            " to " + std::to_string(range.max) + unit_of(axis);
  }
  return list;
}

/// Directions this close to the warp leave no significant digits for rx.
constexpr double least_across = 1e-9;

double size_of(const Direction& d) {
  return std::hypot(d.u, d.v, d.up);
}

}  // namespace

std::string_view to_string(Axis axis) {
  constexpr std::array<std::string_view, axis_count> names{"x", "y", "z", "rx", "ry"};
  return names[index(axis)];
}

ProbePose forward(const Geometry& geometry, const Joints& joints) {
  const double rx = joints[Axis::rx];
  const double ry = joints[Axis::ry];
  // The face's centre in the world, from the fabric's origin at zero tilt (u, v, up).
  const double u = joints[Axis::x] - geometry.origin_m.x_m + geometry.probe_arm_m * std::sin(ry);
  const double v = joints[Axis::y] - geometry.origin_m.y_m;
  const double up =
      geometry.surface_z_m - joints[Axis::z] + geometry.probe_arm_m * (1 - std::cos(ry));
  const auto [a, b] = turned(v - geometry.tilt_axis_y_m, up + geometry.tilt_axis_depth_m, -rx);
  return {.contact_m = {u, geometry.tilt_axis_y_m + a},
          .clearance_m = b - geometry.tilt_axis_depth_m,
          .tilt_x_rad = rx,
          .tilt_y_rad = ry};
}

Result<Joints> inverse(const Geometry& geometry, const ProbePose& pose) {
  if (!finite(pose) || std::abs(pose.tilt_x_rad) >= quarter_turn ||
      std::abs(pose.tilt_y_rad) >= quarter_turn)
    return unusable("probe pose invalid", "finite numbers and tilts below a quarter turn");
  const double arm = geometry.probe_arm_m;
  const auto [a, b] = turned(pose.contact_m.y_m - geometry.tilt_axis_y_m,
                             pose.clearance_m + geometry.tilt_axis_depth_m, pose.tilt_x_rad);
  const double up = b - geometry.tilt_axis_depth_m;
  Joints joints;
  joints[Axis::x] = pose.contact_m.x_m + geometry.origin_m.x_m - arm * std::sin(pose.tilt_y_rad);
  joints[Axis::y] = geometry.tilt_axis_y_m + a + geometry.origin_m.y_m;
  joints[Axis::z] = geometry.surface_z_m - up + arm * (1 - std::cos(pose.tilt_y_rad));
  joints[Axis::rx] = pose.tilt_x_rad;
  joints[Axis::ry] = pose.tilt_y_rad;
  if (std::string list = unreachable(geometry, joints); !list.empty())
    return fail({.code = Errc::range,
                 .where = "kinematics",
                 .what = "pose outside the travel of the stages",
                 .expected = "every stage within its travel",
                 .got = std::move(list)});
  return joints;
}

double lean_rad(const ProbePose& pose) {
  // atan2 keeps full precision near zero, where acos(cos cos) loses half the digits.
  const double sx = std::sin(pose.tilt_x_rad);
  const double sy = std::sin(pose.tilt_y_rad);
  const double along = std::cos(pose.tilt_x_rad) * std::cos(pose.tilt_y_rad);
  const double across = std::hypot(sy, sx * std::cos(pose.tilt_y_rad));
  return std::atan2(across, along);
}

Direction probe_axis(const Tilts& tilts) {
  const double along = std::cos(tilts.ry_rad);
  return {-std::sin(tilts.ry_rad), along * std::sin(tilts.rx_rad), along * std::cos(tilts.rx_rad)};
}

Result<Tilts> tilts_along(const Direction& normal) {
  const double size = size_of(normal);
  if (!std::isfinite(size) || !(size > 0))
    return unusable("normal without a direction", "finite components, not all zero");
  const double across = std::hypot(normal.v, normal.up);
  if (across <= least_across * size)
    return unusable("normal along the warp, so rx is undetermined",
                    "a normal that points away from the plate");
  if (!(normal.up > 0))
    return unusable("normal does not point away from the plate", "a tilt below a quarter turn");
  return Tilts{std::atan2(normal.v, normal.up), std::atan2(-normal.u, across)};
}

double angle_between(const Direction& a, const Direction& b) {
  const double cross =
      std::hypot(a.v * b.up - a.up * b.v, a.up * b.u - a.u * b.up, a.u * b.v - a.v * b.u);
  return std::atan2(cross, a.u * b.u + a.v * b.v + a.up * b.up);
}

Result<SurfacePose> surface_pose(const Geometry& geometry, const Joints& joints) {
  const auto is_number = [](double value) { return std::isfinite(value); };
  if (!std::ranges::all_of(joints.value, is_number) || std::abs(joints[Axis::rx]) >= quarter_turn ||
      std::abs(joints[Axis::ry]) >= quarter_turn)
    return unusable("stage positions invalid", "finite numbers and tilts below a quarter turn");
  const ProbePose pose = forward(geometry, joints);
  return SurfacePose{pose.contact_m, pose.clearance_m,
                     probe_axis({pose.tilt_x_rad, pose.tilt_y_rad})};
}

Result<Joints> joints_on(const Geometry& geometry, const SurfacePose& pose) {
  const Result<Tilts> tilts = tilts_along(pose.normal);
  if (!tilts) return pass(tilts.error());
  return inverse(geometry, {pose.contact_m, pose.clearance_m, tilts->rx_rad, tilts->ry_rad});
}

}  // namespace weft::recipes
