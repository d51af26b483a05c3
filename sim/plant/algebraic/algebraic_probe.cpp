#include "sim/plant/algebraic/algebraic_probe.hpp"

#include <algorithm>
#include <cmath>

namespace weft::sim {
namespace {

constexpr double held_share_of_slack = 0.25;

/// A probe that hangs at the lower end of the slack touches earlier by the slack.
ContactGeometry hanging(ContactGeometry geometry, const Mount& mount) {
  geometry.plate_z_m -= mount.slack_m;
  return geometry;
}

/// The map averages e^{h/scale}, which is linear to h/(2 scale). A scale far above the surface's
/// roughness leaves an error of 0.2 %; the rounding of float is then still 1e-4 of the roughness.
constexpr double scale_per_rms = 250;

double rms_m(const HeightField& field) {
  double variance = 0;
  for (const HeightField::Term& term : field.terms())
    variance += 0.5 * term.amplitude_m * term.amplitude_m;
  return std::sqrt(variance);
}

}  // namespace

AlgebraicProbe::AlgebraicProbe(const ContactGeometry& geometry, const Mount& mount,
                               const ContactMaterial& material, double set_point_n)
    : slack_m_(mount.slack_m),
      set_point_n_(set_point_n),
      resting_(hanging(geometry, mount), material, mount.weight_n()),
      pressed_(hanging(geometry, mount), material, set_point_n) {}

ContactState AlgebraicProbe::step(const ContactState& from, const Pose& to) const {
  ContactState state = resting_.step(from, to);
  const double extension_m = state.extension_m - slack_m_;
  const bool was_pressed = from.normal_n == set_point_n_;
  const bool pressed =
      state.normal_n > 0 && extension_m >= (was_pressed ? -held_share_of_slack * slack_m_ : 0);
  if (pressed) state = pressed_.step(from, to);
  state.extension_m -= slack_m_;
  return state;
}

double AlgebraicProbe::pressure_pa(const ContactState& state, double dx_m, double dy_m,
                                   double height_m) const {
  return pressed_.pressure_pa(state, dx_m, dy_m, height_m);
}

LinearTexture::LinearTexture(const HeightField& field)
    : scale_m_(scale_per_rms * std::max(rms_m(field), 1e-12)), map_(field, scale_m_) {}

double LinearTexture::height_m(double u_m, double v_m, TextureMap::Cursor& cursor) {
  return scale_m_ * std::log(map_.response(u_m, v_m, cursor));
}

AlgebraicContact::AlgebraicContact(const ContactGeometry& geometry, const ContactMaterial& material,
                                   double set_point_n)
    : statics_(geometry, {}, material),
      geometry_(geometry),
      material_(material),
      set_point_n_(set_point_n) {}

ContactState AlgebraicContact::step(const ContactState& from, const Pose& to) const {
  if (!reachable(to)) return from;
  ContactState state;
  state.pose = to;
  const Vector2 slope = geometry_.face_slope(to);
  state.slope_x = slope[0];
  state.slope_y = slope[1];
  const double depth_m = to.z_m - statics_.surface_z_m(to);
  state.indentation_m = depth_m;
  if (!(depth_m >= 0)) return state;
  const double top_n = geometry_.face_area_m2() * material_.law.pressure_pa;
  state.exponent = std::log1p(set_point_n_ / top_n);
  state.growth = 1 + set_point_n_ / top_n;
  state.indentation_m = material_.law.lambda_m * state.exponent;
  state.extension_m = depth_m - state.indentation_m;
  state.normal_n = set_point_n_;
  state.load_ratio = 1;
  const Vector2 moved{to.x_m - from.pose.x_m, to.y_m - from.pose.y_m};
  const double distance_m = std::hypot(moved[0], moved[1]);
  state.bristle = from.bristle;
  if (from.normal_n > 0 && distance_m > 0)
    state.bristle = {moved[0] / distance_m, moved[1] / distance_m};
  const double friction_n = material_.friction.sliding_n(set_point_n_);
  state.friction_n = {friction_n * state.bristle[0], friction_n * state.bristle[1]};
  return state;
}

double AlgebraicContact::pressure_pa(const ContactState& state, double dx_m, double dy_m,
                                     double height_m) const {
  if (!(state.normal_n > 0)) return 0;
  const Waviness& waves = material_.waviness;
  const double x = state.pose.x_m, y = state.pose.y_m;
  const double local_m = height_m + state.slope_x * dx_m + state.slope_y * dy_m +
                         waves.height_m(x + dx_m, y + dy_m) - waves.height_m(x, y);
  const double mean_pa = state.normal_n / geometry_.face_area_m2();
  const double stiffness_pa_m = (mean_pa + material_.law.pressure_pa) / material_.law.lambda_m;
  return std::max(0.0, mean_pa + stiffness_pa_m * local_m);
}

}  // namespace weft::sim
