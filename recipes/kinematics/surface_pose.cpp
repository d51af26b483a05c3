#include "recipes/kinematics/surface_pose.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace weft::recipes {
namespace {

/// Directions this close to the warp leave no digits for rx.
constexpr double least_across = 1e-9;

double size_of(const Direction& d) {
  return std::hypot(d.u, d.v, d.up);
}

}  // namespace

Direction probe_axis(const Tilts& tilts) {
  const double along = std::cos(tilts.ry_rad);
  return {-std::sin(tilts.ry_rad), along * std::sin(tilts.rx_rad), along * std::cos(tilts.rx_rad)};
}

Result<Tilts> tilts_along(const Direction& normal) {
  const double size = size_of(normal);
  if (!std::isfinite(size) || !(size > 0))
    return fail({.code = Errc::invalid_argument,
                 .where = "kinematics",
                 .what = "the normal has no direction",
                 .expected = "finite components, not all zero"});
  const double across = std::hypot(normal.v, normal.up);
  if (across <= least_across * size)
    return fail({.code = Errc::invalid_argument,
                 .where = "kinematics",
                 .what = "the normal lies along the warp, where rx is undetermined",
                 .expected = "a normal that points away from the plate"});
  if (!(normal.up > 0))
    return fail({.code = Errc::invalid_argument,
                 .where = "kinematics",
                 .what = "the normal does not point away from the plate",
                 .expected = "a lean under a quarter turn"});
  return Tilts{std::atan2(normal.v, normal.up), std::atan2(-normal.u, across)};
}

double angle_between(const Direction& a, const Direction& b) {
  const double cross =
      std::hypot(a.v * b.up - a.up * b.v, a.up * b.u - a.u * b.up, a.u * b.v - a.v * b.u);
  return std::atan2(cross, a.u * b.u + a.v * b.v + a.up * b.up);
}

Result<SurfacePose> surface_pose(const Geometry& geometry, const Joints& joints) {
  constexpr double quarter_turn = std::numbers::pi / 2;
  const auto is_number = [](double value) { return std::isfinite(value); };
  if (!std::ranges::all_of(joints.value, is_number) || std::abs(joints[Axis::rx]) >= quarter_turn ||
      std::abs(joints[Axis::ry]) >= quarter_turn)
    return fail({.code = Errc::invalid_argument,
                 .where = "kinematics",
                 .what = "the stage positions are not usable",
                 .expected = "finite numbers and tilts under a quarter turn"});
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
