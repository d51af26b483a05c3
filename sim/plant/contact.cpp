#include "sim/plant/contact.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace weft::sim {

namespace {

constexpr double largest_exponent = 700;   // e^700 is still finite
constexpr int newton_limit = 80;           // 1 to 3 in use, more if a bracket is needed
constexpr double newton_tolerance = 1e-4;  // in s; the method is cubic, so that its cube remains
constexpr double cubic = 1e-6;             // share of the residual that may remain
constexpr double nothing_n = 1e-12;  // a larger residual means a corner (of the mount) in between
constexpr double settled = 1e-13;    // in s; such a guess needs no step
constexpr double largest_angle_rad = 1;  // of a plate or a face: no bench tilts further

/// tan(angle), with a fast path for exactly zero.
double slope_of(double angle_rad) {
  if (angle_rad == 0) return 0;
  return std::tan(std::clamp(angle_rad, -largest_angle_rad, largest_angle_rad));
}

}  // namespace

// The plate is a plane through (plate_centre, axis): turned by its own tilt, then with the platform
// about the axis. Its normal is R_x(rx) (-tan ty / cos tx, -tan tx, 1).
Vector2 ContactGeometry::plate_slope(const Pose& pose) const {
  const double lean_rad = plate_tilt_x_rad + pose.rx_rad;
  if (plate_tilt_y_rad == 0) return {0, slope_of(lean_rad)};
  const double along_y = slope_of(lean_rad);
  return {slope_of(plate_tilt_y_rad) * std::hypot(1, along_y), along_y};
}

double ContactGeometry::plate_rise_m(const Pose& pose, const Vector2& slope) const {
  double rise_m = slope[0] * (pose.x_m - plate_centre_x_m) + slope[1] * (pose.y_m - tilt_axis_y_m);
  if (tilt_axis_depth_m != 0 && pose.rx_rad != 0)
    rise_m += tilt_axis_depth_m * (std::cos(pose.rx_rad) - 1 + slope[1] * std::sin(pose.rx_rad));
  return rise_m;
}

Vector2 ContactGeometry::face_slope(const Pose& pose, const Vector2& plate) const {
  return {tilt_x + plate[0] - slope_of(pose.ry_rad), tilt_y + plate[1]};
}

/// weight + mount force - fabric force as a function of the exponent s. Decreases monotonically.
struct ContactModel::Balance {
  const ContactModel& model;
  const RelaxationStep& relaxation;
  double offset_n;  // force reduction by relaxation
  double s_from;    // s at the start of the step
  double branch_from;
  double extension_0;          // mount extension at s = 0
  double s_near, growth_near;  // e^s at s_near is growth_near

  struct Value {
    double residual_n, elastic_n, force_n, branch, growth;
  };
  struct Slopes {
    double slope_n, bend_n;  ///< of the residual, per unit of s
  };

  /// Value for a given branch of the hysteresis.
  [[nodiscard]] WEFT_SIM_INLINE Value with(double s, double growth, double branch) const {
    Value value{0, model.top_n_ * (growth - 1), 0, branch, growth};
    if (model.turn_ > 0) value.elastic_n *= 1 + model.turn_ * (branch - 1);
    value.force_n = std::max(0.0, relaxation.gain * value.elastic_n - offset_n);
    value.residual_n = model.mount_.weight_n() + model.mount_.force_n(extension(s)) - value.force_n;
    return value;
  }

  [[nodiscard]] WEFT_SIM_INLINE Value at(double s) const {
    const double growth = growth_near * near_exp(std::min(s, largest_exponent) - s_near);
    if (!(model.turn_ > 0)) return with(s, growth, branch_from);
    const double moved = s - s_from;
    const double retained = near_exp(-std::abs(moved) * model.per_length_);
    return with(s, growth, branch_after(branch_from, moved, retained));
  }

  [[nodiscard]] WEFT_SIM_INLINE Slopes slopes(double s, const Value& value) const {
    Slopes slopes{-model.material_.law.lambda_m * model.mount_.slope_n_m(extension(s)), 0};
    if (!(value.force_n > 0)) return slopes;
    double slope = model.top_n_ * value.growth, bend = slope;
    if (model.turn_ > 0) {
      // The curve has a corner at the start of the step: use the side towards the root.
      const double moved = s - s_from, full_n = model.top_n_ * (value.growth - 1);
      const double sign = (moved != 0 ? moved > 0 : value.residual_n > 0) ? 1 : -1;
      const double factor = 1 + model.turn_ * (value.branch - 1);
      const double turning = model.turn_ * (1 - sign * value.branch) * model.per_length_;
      bend = bend * (factor + 2 * turning) - full_n * turning * sign * model.per_length_;
      slope = slope * factor + full_n * turning;
    }
    slopes.slope_n -= relaxation.gain * slope;
    slopes.bend_n = -relaxation.gain * bend;
    return slopes;
  }

  [[nodiscard]] double extension(double s) const {
    return extension_0 - model.material_.law.lambda_m * s;
  }

  /// Upper limit of s for any load of the mount.
  [[nodiscard]] double highest() const {
    const double load = model.mount_.weight_n() + model.mount_.force_n(extension_0);
    const double weakest = branch_factor(-1, model.material_.hysteresis.eta);
    return std::log1p((load + offset_n) / (relaxation.gain * weakest * model.top_n_));
  }

  /// Halley's method from the start of the step. Far up the exponential it falls back to Newton's
  /// method with a bracket that every value tightens. `s` becomes the root.
  [[nodiscard]] WEFT_SIM_INLINE Value solve(double& s) const {
    double low = 0, high = std::numeric_limits<double>::infinity();
    s = s_near;
    Value value = s == s_from ? with(s, growth_near, branch_from) : at(s);
    for (int i = 0; i < newton_limit; ++i) {
      (value.residual_n > 0 ? low : high) = s;
      const auto [slope_n, bend_n] = slopes(s, value);
      // Halley's step r/(f' - r f''/(2 f')) with one division, if it differs little from Newton's.
      const double square = slope_n * slope_n;
      const double halley = square - 0.5 * value.residual_n * bend_n;
      const bool near = halley > 0.5 * square && halley < 2 * square;
      double next = s - (near ? value.residual_n * slope_n / halley : value.residual_n / slope_n);
      if (std::abs(next - s) <= settled) break;
      if (!(next >= low && next <= std::min(high, s + 1))) {
        high = std::min(high, std::max(low, highest()));
        if (!(next >= low && next <= high)) next = 0.5 * (low + high);
      }
      const double moved = std::abs(next - s), before_n = std::abs(value.residual_n);
      value = at(s = next);
      if (moved < newton_tolerance && std::abs(value.residual_n) <= cubic * before_n + nothing_n)
        break;
    }
    return value;
  }
};

double ContactModel::surface_z_m(const Pose& pose, const Vector2& plate_slope) const {
  return geometry_.plate_z_m - material_.thickness_m - geometry_.plate_rise_m(pose, plate_slope);
}

/// Computes the tilt of the face against the plate if the rotations have changed.
void ContactModel::lean(ContactState& state, const Pose& pose) const {
  if (state.pose.rx_rad == pose.rx_rad && state.pose.ry_rad == pose.ry_rad &&
      !std::isnan(state.log_tilt))
    return;
  state.plate_slope = geometry_.plate_slope(pose);
  const Vector2 slope = geometry_.face_slope(pose, state.plate_slope);
  state.slope_x = slope[0];
  state.slope_y = slope[1];
  const double half = geometry_.face_half_width_m * per_lambda_;
  state.log_tilt = log_sinhc(slope[0] * half) + log_sinhc(slope[1] * half);
}

void ContactModel::press(ContactState& state, const RelaxationStep& relaxation, double surface_z_m,
                         double at_touch_m) const {
  const double lambda_m = material_.law.lambda_m;
  const Balance balance{*this,
                        relaxation,
                        relaxation.offset_n(state.relaxation),
                        state.exponent,
                        state.branch,
                        at_touch_m,
                        std::clamp(state.exponent, 0.0, largest_exponent),
                        state.exponent > 0 ? state.growth : 1};
  const auto value = balance.solve(state.exponent);
  state.growth = value.growth;
  state.branch = value.branch;
  state.normal_n = value.force_n;
  const double grown = state.exponent > 1e-3 ? value.growth - 1  // smaller exponents would cancel
                                             : std::expm1(std::max(state.exponent, 1e-12));
  state.load_ratio = value.force_n / (top_n_ * grown);
  state.extension_m = balance.extension_0 - lambda_m * state.exponent;
  state.indentation_m = state.probe_z_m() - surface_z_m;
  relaxation.advance(state.relaxation, value.elastic_n);
}

void ContactModel::hang(ContactState& state, const RelaxationStep& relaxation, double surface_z_m,
                        double log_average) const {
  state.extension_m = mount_.hanging_extension_m();
  state.indentation_m = state.probe_z_m() - surface_z_m;
  state.exponent = state.indentation_m * per_lambda_ + log_average;
  state.growth = 1;
  state.branch = -1;
  state.normal_n = 0;
  state.load_ratio = 0;
  relaxation.advance(state.relaxation, 0);
}

/// State at the beginning of the step that the friction needs.
struct ContactModel::Before {
  double x_m, y_m, normal_n;
};

void ContactModel::slide(ContactState& state, const Before& before) const {
  const Friction& friction = material_.friction;
  if (!(state.normal_n > 0) || !(friction.coefficient > 0)) {
    state.bristle = state.friction_n = {};
    state.sliding_n = 0;
    return;
  }
  const Vector2 moved{state.pose.x_m - before.x_m, state.pose.y_m - before.y_m};
  state.bristle = bristle_after(state.bristle, moved, friction.bristle_length_m);
  const double change = state.normal_n / before.normal_n - 1;
  state.sliding_n = state.sliding_n > 0 && std::abs(change) < 0.01
                        ? state.sliding_n * power_.of_change(change)
                        : friction.sliding_n(state.normal_n);
  state.friction_n = {state.sliding_n * state.bristle[0], state.sliding_n * state.bristle[1]};
}

ContactState ContactModel::step(const ContactState& from, const Pose& pose, double dt_s) const {
  ContactState state = from;
  if (dt_s >= 0 && dt_s <= std::numeric_limits<double>::max())
    advance(state, pose, RelaxationStep(material_.relaxation, dt_s));
  return state;
}

WEFT_SIM_CLONES void ContactModel::advance(ContactState& state, const Pose& pose,
                                           const RelaxationStep& relaxation) const {
  if (!reachable(pose)) return;
  const Before before{state.pose.x_m, state.pose.y_m, state.normal_n};
  lean(state, pose);
  state.pose = pose;
  // ln of the average of e^{(waviness + slope r)/lambda} over the face.
  const double average =
      material_.waviness.height_m(pose.x_m, pose.y_m) * per_lambda_ + state.log_tilt;
  const double surface_m = surface_z_m(pose, state.plate_slope);
  const double at_touch_m =
      pose.z_m - (surface_m - material_.law.lambda_m * average);  // extension at s = 0
  if (mount_.weight_n() + mount_.force_n(at_touch_m) > 0)
    press(state, relaxation, surface_m, at_touch_m);
  else
    hang(state, relaxation, surface_m, average);
  slide(state, before);
}

double ContactModel::pressure_pa(const ContactState& state, double dx_m, double dy_m,
                                 double texture) const {
  if (!(state.normal_n > 0)) return 0;
  const double local_m =
      state.indentation_m + state.slope_x * dx_m + state.slope_y * dy_m +
      material_.waviness.height_m(state.face_x_m() + dx_m, state.face_y_m() + dy_m);
  const double growth =
      std::exp(std::clamp(local_m * per_lambda_, -largest_exponent, largest_exponent));
  return std::clamp(state.load_ratio * material_.law.pressure_pa * (growth * texture - 1), 0.0,
                    largest_pad_pressure_pa);
}

}  // namespace weft::sim
