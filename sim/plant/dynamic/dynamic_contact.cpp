#include "sim/plant/dynamic/dynamic_contact.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "sim/plant/bounds.hpp"
#include "sim/plant/dynamic/motion.hpp"

namespace weft::sim {
namespace {

constexpr double longest_s = 3600;
constexpr double shortest_s = 1e-12;          // a shorter step of the stages is a jump
constexpr double largest_pressure_pa = 1e12;  // upper limit of the law; no bench presses so hard
constexpr int most_cuts = 8;             // events in one substep; more are chatter and are skipped
constexpr int event_iterations = 60;     // 4 to 6 in use
constexpr double event_exponent = 1e-9;  // |s| at which an event counts as located
constexpr double least_share = 1e-9;     // of a substep; an event nearer to an end is at the end

Status check_geometry(const ContactGeometry& geometry) {
  return check_bounds("geometry",
                      {{"plate height [m]", geometry.plate_z_m, -10, 10},
                       {"half the width of the face [m]", geometry.face_half_width_m, 1e-5, 1},
                       {"tilt axis y [m]", geometry.tilt_axis_y_m, -10, 10},
                       {"tilt axis depth [m]", geometry.tilt_axis_depth_m, -10, 10},
                       {"tilt along x", geometry.tilt_x, -1, 1},
                       {"tilt along y", geometry.tilt_y, -1, 1},
                       {"plate tilt about x", geometry.plate_tilt_x_rad, -1, 1},
                       {"plate tilt about y", geometry.plate_tilt_y_rad, -1, 1},
                       {"plate centre x [m]", geometry.plate_centre_x_m, -10, 10}});
}

Status check_mount(const Mount& mount) {
  return check_bounds("mount", {{"probe mass [kg]", mount.mass_kg, 1e-6, 100},
                                {"mount stiffness [N/m]", mount.stiffness_n_m, 1e-3, 1e10},
                                {"slack [m]", mount.slack_m, 0, 1},
                                {"stop stiffness [N/m]", mount.stop_stiffness_n_m, 1e-3, 1e10}});
}

Status check_material(const ContactMaterial& material) {
  const Relaxation& relaxation = material.relaxation;
  const Friction& friction = material.friction;
  if (Status s = check_bounds(
          "cloth",
          {{"lambda [m]", material.law.lambda_m, 1e-9, 1},
           {"p_s [Pa]", material.law.pressure_pa, 1e-6, 1e9},
           {"thickness [m]", material.thickness_m, 0, 1},
           {"hysteresis", material.hysteresis.eta, 0, 0.999},
           {"hysteresis length", material.hysteresis.length, 1e-3, 100},
           {"first relaxation share", relaxation.share[0], 0, 0.999},
           {"second relaxation share", relaxation.share[1], 0, 0.999},
           {"sum of the relaxation shares", relaxation.share[0] + relaxation.share[1], 0, 0.999},
           {"first relaxation time [s]", relaxation.time_s[0], 1e-6, 1e9},
           {"second relaxation time [s]", relaxation.time_s[1], 1e-6, 1e9}});
      !s)
    return s;
  return check_bounds("friction", {{"coefficient", friction.coefficient, 0, 100},
                                   {"reference load [N]", friction.reference_load_n, 1e-6, 1e6},
                                   {"exponent", friction.exponent, 0, 2},
                                   {"bristle length [m]", friction.bristle_length_m, 1e-9, 1}});
}

Status check_dynamics(const DynamicsParams& params) {
  if (params.integrator > Integrator::adaptive)
    return fail({.code = Errc::range,
                 .where = "dynamics",
                 .what = "integrator unknown",
                 .expected = "midpoint, tr_bdf2 or adaptive"});
  return check_bounds("dynamics",
                      {{"step [s]", params.step_s, 1e-9, 1},
                       {"normal damping", params.normal_damping, 0, 100},
                       {"lateral stiffness [N/m]", params.lateral_stiffness_n_m, 1e-3, 1e10},
                       {"lateral damping", params.lateral_damping, 0, 100},
                       {"static ratio", params.static_ratio, 1, 10},
                       {"Stribeck speed [m/s]", params.stribeck_speed_mps, 1e-9, 1e3},
                       {"speed of the friction test [m/s]", params.friction_speed_mps, 0, 1e6},
                       {"bristle damping", params.bristle_damping, 0, 100},
                       {"viscous friction [N s/m]", params.viscous_n_s_m, 0, 1e6}});
}

}  // namespace

DynamicContact::DynamicContact(const ContactGeometry& geometry, const Mount& mount,
                               const ContactMaterial& material, const DynamicsParams& params)
    : statics_(geometry, mount, material),
      geometry_(geometry),
      material_(material),
      params_(params),
      law_{.lambda_m = material.law.lambda_m,
           .top_n = geometry.face_area_m2() * material.law.pressure_pa,
           .largest_exponent = std::log(largest_pressure_pa / material.law.pressure_pa),
           .hysteresis = material.hysteresis,
           .mount = mount,
           .damper_n_s_m =
               2 * params.normal_damping * std::sqrt(mount.stiffness_n_m * mount.mass_kg)},
      glide_law_{
          mount.mass_kg, params.lateral_stiffness_n_m,
          2 * params.lateral_damping * std::sqrt(params.lateral_stiffness_n_m * mount.mass_kg)},
      kinetic_at_reference_n_(
          material.friction.coefficient * material.friction.reference_load_n /
          LuGre{.static_ratio = params.static_ratio, .stribeck_mps = params.stribeck_speed_mps}
              .limit_ratio(params.friction_speed_mps)) {}

ContactState DynamicContact::step(const ContactState& from, const Pose& to, double dt_s,
                                  const Instants& instants, std::span<SlidingContact> at) const {
  std::fill(at.begin(), at.end(), contact_at_rest(from));
  if (!reachable(from.pose) || !reachable(to) || !(dt_s >= 0 && dt_s <= longest_s)) return from;
  if (dt_s < shortest_s && to == from.pose) return from;
  const Approach path = approach(from, to, dt_s);
  Motion motion = begin(from, path);
  if (dt_s >= shortest_s) {
    travel(motion, path, dt_s, instants, at);
  } else {
    settle_memory(motion.memory, (motion.z_m - path.touch_z_m) * law_.per_lambda,
                  RelaxationStep(material_.relaxation, 0));
    motion.normal_n = force_n(motion.memory);
  }
  return finish(from, to, motion, path, dt_s);
}

/// Moves through the whole step, from one instant to the next.
void DynamicContact::travel(Motion& motion, const Approach& path, double dt_s,
                            const Instants& instants, std::span<SlidingContact> at) const {
  double t_s = 0;
  if (instants.count > 0) {
    if (instants.first_s >= shortest_s) {
      cover(motion, path, 0, instants.first_s);
      t_s = instants.first_s;
    }
    const bool paced =
        params_.integrator == Integrator::adaptive && instants.every_s > params_.step_s;
    const std::optional<Leg> each =
        paced ? std::nullopt : std::optional(leg(instants.every_s, params_.step_s));
    for (std::size_t i = 0; i < instants.count; ++i) {
      if (i > 0) {
        if (each)
          go(motion, path, t_s, *each);
        else
          cover(motion, path, t_s, instants.every_s);
        t_s = instants.first_s + static_cast<double>(i) * instants.every_s;
      }
      if (!at.empty()) at[i] = seen(motion, path, t_s);
    }
  }
  if (dt_s - t_s >= shortest_s) cover(motion, path, t_s, dt_s - t_s);
}

DynamicContact::Leg DynamicContact::leg(double length_s, double step_s) const {
  return {material_.relaxation, params_.integrator, length_s, step_s};
}

void DynamicContact::go(Motion& motion, const Approach& path, double t_s, const Leg& leg) const {
  for (double i = 0; i < leg.substeps; ++i) advance(motion, path, t_s + i * leg.span.h_s, leg.span);
}

/// Moves on by `length_s` from `t_s`, in substeps of the integrator.
void DynamicContact::cover(Motion& motion, const Approach& path, double t_s,
                           double length_s) const {
  const double step_s = std::max(params_.step_s, length_s / most_substeps);
  if (params_.integrator != Integrator::adaptive || length_s <= step_s) {
    go(motion, path, t_s, leg(length_s, step_s));
    return;
  }
  const double parts = Leg::whole(length_s / (longest_ease * step_s));
  const double sample_s = length_s / parts;
  for (double i = 0; i < parts; ++i) {
    const double from_s = t_s + i * sample_s;
    go(motion, path, from_s, leg(sample_s, substep_s(motion, path, from_s, sample_s, step_s)));
  }
}

SlidingContact DynamicContact::seen(const Motion& motion, const Approach& path, double t_s) const {
  const Vector2& lag = motion.glide.lag_m;
  return {.place_m = {path.stage_m[0] + path.stage_mps[0] * t_s - lag[0],
                      path.stage_m[1] + path.stage_mps[1] * t_s - lag[1]},
          .friction_n = friction_n(motion, path),
          .normal_n = motion.normal_n,
          .stiffness_n_m = stiffness_n_m(motion.normal_n)};
}

SlidingContact DynamicContact::contact_at_rest(const ContactState& state) const {
  return {{state.face_x_m(), state.face_y_m()},
          state.friction_n,
          state.normal_n,
          stiffness_n_m(state.normal_n)};
}

double DynamicContact::stiffness_n_m(double normal_n) const {
  return normal_n > 0 ? (normal_n + law_.top_n) * law_.per_lambda : 0;
}

Approach DynamicContact::approach(const ContactState& from, const Pose& to, double dt_s) const {
  const bool jump = !(dt_s >= shortest_s);
  const double per_s = jump ? 0 : 1 / dt_s, lambda_m = material_.law.lambda_m;
  // In a jump the probe keeps its position, and the lag changes by the stages' jump.
  Vector2 lag = from.lag_m;
  if (jump) lag = {lag[0] + to.x_m - from.pose.x_m, lag[1] + to.y_m - from.pose.y_m};
  const Vector2 moved{to.x_m - from.pose.x_m, to.y_m - from.pose.y_m};
  // One plane for the whole step touches the waves at the middle of the step. The planes of
  // successive steps then agree to the third order.
  const double share = jump ? 0 : 0.5;
  Pose middle = from.pose;
  middle.x_m += share * moved[0] - from.lag_m[0];
  middle.y_m += share * moved[1] - from.lag_m[1];
  const Waviness::Tangent waves = material_.waviness.tangent(middle.x_m, middle.y_m);
  const auto touch = [&](const Pose& pose, double side) {
    Pose face = pose;
    face.x_m -= lag[0];
    face.y_m -= lag[1];
    const double half = geometry_.face_half_width_m / lambda_m;
    const Vector2 slope = geometry_.face_slope(pose);
    const double tilt = log_sinhc(slope[0] * half) + log_sinhc(slope[1] * half);
    return statics_.surface_z_m(face) - lambda_m * tilt - waves.height_m -
           side * 0.5 * (waves.slope_x * moved[0] + waves.slope_y * moved[1]);
  };
  const double at_begin = jump ? touch(to, 0) : touch(from.pose, -1);
  const double at_end = jump ? at_begin : touch(to, 1);
  const Pose& start = jump ? to : from.pose;
  const Vector2 plate = geometry_.plate_slope(from.pose);
  return {.stage_z_m = start.z_m,
          .stage_z_mps = (to.z_m - from.pose.z_m) * per_s,
          .stage_m = {start.x_m, start.y_m},
          .stage_mps = {moved[0] * per_s, moved[1] * per_s},
          .touch_z_m = at_begin,
          .touch_mps = (at_end - at_begin) * per_s,
          .touch_per_lag = {waves.slope_x + plate[0], waves.slope_y + plate[1]},
          .lag_m = lag};
}

DynamicContact::Motion DynamicContact::begin(const ContactState& from,
                                             const Approach& approach) const {
  return {
      .z_m = from.probe_z_m(),
      .v_mps = from.velocity_mps[2],
      .memory = {from.exponent, from.exponent > 0 ? from.growth : 1, from.branch, from.relaxation},
      .touching = from.exponent > 0,
      .normal_n = from.normal_n,
      .glide = {approach.lag_m, {from.velocity_mps[0], from.velocity_mps[1]}, from.bristle},
      .power = NearPower(material_.friction.exponent)};
}

ContactState DynamicContact::finish(const ContactState& from, const Pose& to, const Motion& motion,
                                    const Approach& approach, double dt_s) const {
  ContactState state = from;
  state.pose = to;
  const Vector2 slope = geometry_.face_slope(to);
  state.slope_x = slope[0];
  state.slope_y = slope[1];
  state.log_tilt = std::numeric_limits<double>::quiet_NaN();
  state.lag_m = motion.glide.lag_m;
  state.velocity_mps = {motion.glide.room_mps[0], motion.glide.room_mps[1], motion.v_mps};
  state.exponent = (motion.z_m - approach.touch_at(dt_s, motion.glide.lag_m)) * law_.per_lambda;
  state.growth = state.exponent > 0 ? motion.memory.growth : 1;
  state.branch = motion.memory.branch;
  state.relaxation = motion.memory.relaxation;
  state.bristle = motion.glide.bristle;
  state.normal_n = motion.normal_n;
  state.extension_m = to.z_m - motion.z_m;
  Pose face = to;
  face.x_m = state.face_x_m();
  face.y_m = state.face_y_m();
  state.indentation_m = motion.z_m - statics_.surface_z_m(face);
  state.load_ratio =
      motion.normal_n > 0
          ? motion.normal_n /
                (law_.top_n * std::expm1(std::clamp(state.exponent, 1e-12, law_.largest_exponent)))
          : 0;
  state.sliding_n = 0;
  state.friction_n = friction_n(motion, approach);
  return state;
}

Vector2 DynamicContact::friction_n(const Motion& motion, const Approach& approach) const {
  if (!(motion.normal_n > 0)) return {};
  NearPower power = motion.power;  // a copy: the motion must not change
  return friction(motion.normal_n, power)
      .force_n(motion.glide.bristle, sum(1, approach.stage_mps, 1, motion.glide.room_mps));
}

/// One substep, divided at the point where the face touches or leaves the fabric.
void DynamicContact::advance(Motion& motion, const Approach& approach, double t_s,
                             const Span& whole) const {
  const double first_share = Span::first_share(params_.integrator);
  double at_s = t_s, left_s = whole.h_s;
  Pressed pressed = press(motion, approach, at_s, whole);
  for (int cut = 0; motion.touching != (pressed.memory.exponent > 0) && cut < most_cuts; ++cut) {
    const double share = event_share(motion, approach, at_s, left_s, pressed.memory.exponent);
    if (share > 1 - least_share) break;
    if (share > least_share) {
      const Span span(material_.relaxation, share * left_s, first_share);
      glide(motion, approach, span.h_s, press(motion, approach, at_s, span));
      at_s += span.h_s;
      left_s -= span.h_s;
    }
    motion.touching = !motion.touching;
    settle_memory(motion.memory, 0, RelaxationStep(material_.relaxation, 0));
    pressed = press(motion, approach, at_s, Span(material_.relaxation, left_s, first_share));
  }
  motion.touching = pressed.memory.exponent > 0;
  glide(motion, approach, left_s, pressed);
}

/// The fraction of the substep at which s = 0: false position with Illinois' weights.
double DynamicContact::event_share(const Motion& motion, const Approach& approach, double t_s,
                                   double h_s, double exponent_at_end) const {
  const double first_share = Span::first_share(params_.integrator);
  const double at_begin =
      (motion.z_m - approach.touch_at(t_s, motion.glide.lag_m)) * law_.per_lambda;
  if (!(at_begin * exponent_at_end < 0))
    return 0;  // the last event is at the start of this substep
  double low = 0, high = 1, at_low = at_begin, at_high = exponent_at_end, share = 0;
  bool was_low = false;
  for (int i = 0; i < event_iterations; ++i) {
    share = low + (high - low) * at_low / (at_low - at_high);
    const Span span(material_.relaxation, share * h_s, first_share);
    const double s = press(motion, approach, t_s, span).memory.exponent;
    if (std::abs(s) < event_exponent || high - low < least_share) break;
    const bool is_low = s * at_low > 0;
    (is_low ? low : high) = share;
    (is_low ? at_low : at_high) = s;
    if (i > 0 && is_low == was_low) (is_low ? at_high : at_low) *= 0.5;
    was_low = is_low;
  }
  return share;
}

LuGre DynamicContact::friction(double normal_n, NearPower& power) const {
  const Friction& friction = material_.friction;
  // Quotients of constants can be computed before the load is known.
  const double per_load = 1 / friction.reference_load_n;
  const double mass_per_length = law_.mount.mass_kg / friction.bristle_length_m;
  const double kinetic_n = normal_n > 0 ? kinetic_at_reference_n_ * power(normal_n * per_load) : 0;
  return {.kinetic_n = kinetic_n,
          .static_ratio = params_.static_ratio,
          .stribeck_mps = params_.stribeck_speed_mps,
          .length_m = friction.bristle_length_m,
          .damping_n_s_m = 2 * params_.bristle_damping * std::sqrt(kinetic_n * mass_per_length),
          .viscous_n_s_m = normal_n > 0 ? params_.viscous_n_s_m : 0};
}

/// The substep along x and y, together with the result of press() along z.
void DynamicContact::glide(Motion& motion, const Approach& approach, double h_s,
                           const Pressed& pressed) const {
  if (!(h_s > 0)) return;
  if (params_.integrator != Integrator::tr_bdf2) {
    const LuGre inner = friction(pressed.inner_normal_n, motion.power);
    motion.glide = glide_midpoint(glide_law_, inner, motion.glide, approach.stage_mps, h_s);
  } else {
    const LuGre begin = friction(motion.normal_n, motion.power);
    const LuGre inner = friction(pressed.inner_normal_n, motion.power);
    const LuGre end = friction(pressed.normal_n, motion.power);
    motion.glide =
        glide_tr_bdf2(glide_law_, begin, inner, end, motion.glide, approach.stage_mps, h_s);
  }
  motion.z_m = pressed.z_m;
  motion.v_mps = pressed.v_mps;
  motion.memory = pressed.memory;
  motion.normal_n = pressed.normal_n;
}

Status check(const ContactGeometry& geometry, const Mount& mount, const ContactMaterial& material,
             const DynamicsParams& params) {
  if (Status s = check_geometry(geometry); !s) return s;
  if (Status s = check_mount(mount); !s) return s;
  if (Status s = check_material(material); !s) return s;
  return check_dynamics(params);
}

}  // namespace weft::sim
