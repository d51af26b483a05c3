#include "recipes/alignment/align_plan.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "protocols/base/time.hpp"

namespace weft::recipes {
namespace {

/// Default side of the grid [m].
constexpr double usual_span_m = 0.1;
/// A narrower grid gives a poor angle: 1 um across it is 0.1 mrad [m].
constexpr double least_span_m = 0.01;
/// A touch must exceed the sensor's noise, 12 mN per reading. The sensor's steps of 20 mN:
/// docs/reference/plant.md, Instruments and the force loop.
constexpr double least_contact_force_n = 0.05;
constexpr double least_touch_speed_mps = 1e-6;

tl::unexpected<Error> does_not_fit(std::string message, std::string expected, std::string got,
                                   std::string hint = {}) {
  return fail({.code = Errc::range,
               .where = "alignment",
               .what = std::move(message),
               .expected = std::move(expected),
               .got = std::move(got),
               .hint = std::move(hint)});
}

std::string in_mm(double metres) {
  return std::to_string(metres / m_per_mm) + " mm";
}

/// Range of the face's centre along one axis that both plate and travel allow [m].
Range room(const RigLimits& limits, Axis axis, double origin_m, double size_m, double face_m) {
  const Range& travel = limits.geometry.travel[index(axis)];
  return {std::max(travel.min - origin_m, 0.5 * face_m),
          std::min(travel.max - origin_m, size_m - 0.5 * face_m)};
}

double middle(const Range& range) {
  return 0.5 * (range.min + range.max);
}

/// Row by row, every other row backwards: consecutive points are neighbours on the plate.
std::vector<Vec2> grid(Vec2 centre_m, double span_m, unsigned per_side) {
  const auto along = [&](unsigned i) { return span_m * (double(i) / (per_side - 1) - 0.5); };
  std::vector<Vec2> points;
  for (unsigned row = 0; row < per_side; ++row)
    for (unsigned i = 0; i < per_side; ++i) {
      const unsigned column = row % 2 == 0 ? i : per_side - 1 - i;
      points.push_back({centre_m.x_m + along(column), centre_m.y_m + along(row)});
    }
  return points;
}

Status check_touch(const RigLimits& limits, const AlignSettings& s) {
  const double half_cap_n = 0.5 * limits.force_cap_n;
  if (!(s.contact_force_n >= least_contact_force_n && s.contact_force_n <= half_cap_n))
    return does_not_fit("touch force out of range",
                        std::to_string(least_contact_force_n) + " N to " +
                            std::to_string(half_cap_n) + " N, half of limits.force_cap_N",
                        std::to_string(s.contact_force_n) + " N");
  if (!(s.touch_speed_mps >= least_touch_speed_mps && s.touch_speed_mps <= limits.max_speed_mps))
    return does_not_fit("touch speed out of range",
                        in_mm(least_touch_speed_mps) + "/s to " + in_mm(limits.max_speed_mps) +
                            "/s, limits.speed_mm_s",
                        in_mm(s.touch_speed_mps) + "/s");
  return {};
}

Status check_judgement(const AlignSettings& s, double largest_tilt_rad) {
  if (s.per_side < 2 || s.per_side > 9)
    return does_not_fit("touches per side out of range", "2 to 9", std::to_string(s.per_side));
  if (!(s.largest_residual_m > 0 && s.largest_residual_m <= 1e-2))
    return does_not_fit("plane residual out of range", "above 0, at most 10 mm",
                        in_mm(s.largest_residual_m));
  if (!(s.tolerance_rad > 0 && s.tolerance_rad <= largest_tilt_rad))
    return does_not_fit(
        "tilt tolerance out of range",
        "above 0, at most " + std::to_string(largest_tilt_rad) + " rad, the largest tilt",
        std::to_string(s.tolerance_rad) + " rad");
  if (!(largest_tilt_rad <= 0.5))
    return does_not_fit("largest tilt out of range", "at most 0.5 rad",
                        std::to_string(largest_tilt_rad) + " rad");
  return {};
}

/// Angle that every rotary stage reaches to both sides. Without rotary stages the tilt is only
/// measured.
double rotary_reach_rad(const Geometry& geometry) {
  constexpr double measured_rad = 0.05;
  double reach = geometry.is_fixed(Axis::rx) && geometry.is_fixed(Axis::ry) ? measured_rad : 0.5;
  for (const Axis axis : {Axis::rx, Axis::ry}) {
    if (geometry.is_fixed(axis)) continue;
    const Range& travel = geometry.travel[index(axis)];
    reach = std::min({reach, travel.max, -travel.min});
  }
  return reach;
}

Status check_heights(const AlignPlan& plan) {
  const RigLimits& limits = plan.limits;
  const Range& z = limits.geometry.travel[index(Axis::z)];
  const double top = limits.clear_z_m() - plan.rise_m();
  if (top >= z.min) return {};
  return does_not_fit("travel of z too short above a plate with the largest tilt",
                      "at least " + in_mm(z.min), in_mm(top), "Lower the largest tilt or the span");
}

}  // namespace

double AlignPlan::rise_m() const {
  return reach_m * std::tan(largest_tilt_rad);
}

Result<AlignPlan> plan_alignment(const RigLimits& limits, const AlignSettings& settings) {
  const Geometry& g = limits.geometry;
  if (!limits.has_wrench)
    return fail({.code = Errc::unsupported,
                 .where = "alignment",
                 .what = "alignment needs a force sensor",
                 .expected = "a device with role wrench",
                 .got = "none",
                 .hint = "Level the plate by hand; weft run does not need an alignment"});
  if (g.is_fixed(Axis::y))
    return fail({.code = Errc::unsupported,
                 .where = "alignment",
                 .what = "alignment needs a stage along y",
                 .expected = "stages along x, y and z",
                 .got = "y fixed",
                 .hint = "Level the plate by hand; weft run does not need an alignment"});
  const Range x = room(limits, Axis::x, g.origin_m.x_m, g.plate_size_m.x_m, limits.footprint_m.x_m);
  const Range y = room(limits, Axis::y, g.origin_m.y_m, g.plate_size_m.y_m, limits.footprint_m.y_m);
  const double widest = std::min(x.width(), y.width());
  const double span_m = settings.span_m.value_or(std::min(usual_span_m, widest));
  if (!(span_m >= least_span_m && span_m <= widest))
    return does_not_fit("span of the touches out of range",
                        in_mm(least_span_m) + " to " + in_mm(widest), in_mm(span_m));
  AlignPlan plan;
  plan.limits = limits;
  plan.largest_tilt_rad = settings.largest_tilt_rad.value_or(rotary_reach_rad(g));
  if (Status s = check_judgement(settings, plan.largest_tilt_rad); !s) return pass(s.error());
  if (Status s = check_touch(limits, settings); !s) return pass(s.error());
  plan.points_m = grid({middle(x), middle(y)}, span_m, settings.per_side);
  plan.reach_m =
      std::hypot(0.5 * (span_m + limits.footprint_m.x_m), 0.5 * (span_m + limits.footprint_m.y_m));
  plan.contact_force_n = settings.contact_force_n;
  plan.approach_speed_mps = std::min(plan.approach_speed_mps, limits.max_speed_mps);
  plan.transfer_speed_mps = limits.max_speed_mps;
  plan.touch_speed_mps = settings.touch_speed_mps;
  plan.largest_residual_m = settings.largest_residual_m;
  plan.tolerance_rad = settings.tolerance_rad;
  if (Status s = check_heights(plan); !s) return pass(s.error());
  return plan;
}

}  // namespace weft::recipes
