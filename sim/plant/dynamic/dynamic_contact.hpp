#pragma once
// Level L2 of the probe on the cloth: inertia, LuGre friction, touch-down and lift-off. Same cloth,
// mount and waviness as level L1 (contact.hpp), which it goes over into when the motion is slow.
//
// Along z the probe moves in the room (PressStage), along x and y it lags behind the stages
// (GlideLaw, lugre.hpp). The two are coupled at the step's middle: the normal force there sets the
// friction, the face's place there the cloth's height.

#include <cstddef>
#include <cstdint>
#include <span>

#include "sim/plant/contact.hpp"
#include "sim/plant/dynamic/lugre.hpp"
#include "sim/plant/fabric_law.hpp"
#include "sim/plant/near.hpp"

namespace weft::sim {

/// Memory of the cloth at the instant from which a stage starts.
struct PressMemory {
  double exponent = -1e9;  ///< s; above 0 the cloth is touched
  double growth = 0;       ///< e^s while touched, 1 at first touch
  double branch = -1;
  RelaxationState relaxation;
};

/// What is the same in all stages.
struct PressLaw {
  double lambda_m = 1;
  double top_n = 0;               ///< law's force per unit of e^s - 1: face area times p_s
  double largest_exponent = 700;  ///< the law stays there beyond
  Hysteresis hysteresis;
  Mount mount;
  double damper_n_s_m = 0;
  // What of the above is divided by in every evaluation.
  double per_lambda = 1 / lambda_m, per_length = 1 / hysteresis.length;
  double turn = hysteresis.eta / (1 + hysteresis.eta);

  /// e^s, held at the largest exponent.
  [[nodiscard]] double growth(const PressMemory& memory, double s) const;
  /// Of the hysteresis.
  [[nodiscard]] double branch(const PressMemory& memory, double s) const;
  /// branch_factor(): (1 + eta b)/(1 + eta).
  [[nodiscard]] double factor(double branch) const { return 1 + turn * (branch - 1); }
};

/// Velocity and acceleration at the stage's instant, linear in the displacement d.
struct PressRates {
  double velocity_0, velocity_d;  ///< v = velocity_0 + velocity_d d
  double accel_0, accel_d;        ///< a = accel_0 + accel_d d
};

/// One implicit stage of the probe's motion along z: Newton's law at one instant,
///   m a = weight + mount force + damper - cloth force,
/// with velocity and acceleration linear in the displacement d that is looked for. Implicit
/// midpoint and both stages of TR-BDF2 have this form, with the cloth's memory advanced exactly to
/// that instant. The residual falls monotonically in d, so that there is one root at any step.
struct PressStage {
  const PressLaw& law;
  const PressMemory& memory;
  const RelaxationStep& relaxation;  ///< from the memory's instant to this one
  double z_m, stage_z_m, stage_mps;  ///< z: of the probe, from which d counts
  double exponent_at_z;              ///< s that d = 0 would have at this instant
  PressRates rates;

  struct Value {
    double residual_n, slope_n_m;
    double exponent, growth, elastic_n, force_n, branch;  ///< of the cloth
  };

  /// The root and what belongs to it; `d_m` holds the guess and becomes the root.
  Value solve(double& d_m) const;

 private:
  [[nodiscard]] Value at(double d_m, double offset_n) const;
  [[nodiscard]] double highest_m(double offset_n) const;
  [[nodiscard]] Value follow(const Value& from, double d_m, double ds, double offset_n) const;
};

enum class Integrator : std::uint8_t {
  midpoint,  ///< implicit midpoint with exact memory: keeps undamped motion; for steps that resolve
  tr_bdf2,   ///< L-stable: damps what the step does not resolve; for coarse steps
  adaptive   ///< implicit midpoint whose substeps are longer where the contact is calm
};

/// What level L2 knows beyond L1: the probe's inertia, its guide, and friction that falls with
/// speed. Source: docs/reference/plant.md, Contact law, Friction, Integrators.
struct DynamicsParams {
  /// Substeps are equal and at most this long; nothing else depends on it. Of the adaptive
  /// integrator: their length while the probe swings. A sixteenth of a pad's conversion
  /// (tests/bench/plant_levels.cc has its error and its price).
  double step_s = 192e-6;
  Integrator integrator = Integrator::adaptive;
  double normal_damping = 0.05;        ///< ratio of the mount's spring with the probe's mass [E]
  double lateral_stiffness_n_m = 1e5;  ///< k_l of guide and mount along x and y [E]
  double lateral_damping = 0.05;       ///< ratio, as above [E]
  double static_ratio = 1.2;           ///< F_S/F_C, 1.1 to 1.3 [E]
  double stribeck_speed_mps = 5e-3;    ///< v_s, 1 to 10 mm/s [E]
  /// Speed at which the cloth's friction was measured: there Friction::sliding_n holds (KES-FB4
  /// moves at 1 mm/s [E]).
  double friction_speed_mps = 1e-3;
  double bristle_damping = 0.3;  ///< ratio of the bristles with the probe's mass (sigma_1) [E]
  double viscous_n_s_m = 0;      ///< sigma_2 [E]
};

/// Refuses what the equations have no solution for or doubles no room: NaN, infinities, negative
/// stiffness, steps outside 1 ns to 1 s, and so on. Errors: range, naming the field.
Status check(const ContactGeometry& geometry, const Mount& mount, const ContactMaterial& material,
             const DynamicsParams& params);

/// What a probe moves through during one step of the stages: their straight path, and the height at
/// which its face would just touch the cloth, linear in time and in where the face is.
struct Approach {
  double stage_z_m = 0;  ///< at the step's begin
  double stage_z_mps = 0;
  Vector2 stage_m{};        ///< x and y, as stage_z_m
  Vector2 stage_mps{};      ///< along x and y
  double touch_z_m = 0;     ///< z of the face's centre at first touch, at the step's begin
  double touch_mps = 0;     ///< its change with time for a face that keeps its lag
  Vector2 touch_per_lag{};  ///< its change with the face's lag [1]
  Vector2 lag_m{};          ///< lag to which the above belongs

  [[nodiscard]] double stage_at(double t_s) const { return stage_z_m + stage_z_mps * t_s; }
  [[nodiscard]] double touch_at(double t_s, const Vector2& lag) const {
    return touch_z_m + touch_mps * t_s + touch_per_lag[0] * (lag[0] - lag_m[0]) +
           touch_per_lag[1] * (lag[1] - lag_m[1]);
  }
};

/// Instants within a step of the stages: `first_s`, then every `every_s`; `count` of them, none
/// after the step's end.
struct Instants {
  double first_s = 0, every_s = 0;
  std::size_t count = 0;
};

class DynamicContact {
 public:
  /// The parameters must pass check().
  DynamicContact(const ContactGeometry& geometry, const Mount& mount,
                 const ContactMaterial& material, const DynamicsParams& params);

  /// The state `dt_s` later with the stages at `to`, moved there in a straight line, in equal
  /// substeps of at most `step_s` (no more than 1e8 of them), of the adaptive integrator as long
  /// as the motion allows (dynamic_press.cpp); a substep in which the face touches
  /// or leaves the cloth is cut there. Less than 1 ps lets the stages jump and the probe stay. A
  /// pose that is not finite or further than 1 km away, a negative dt_s and one above an hour
  /// change nothing.
  [[nodiscard]] ContactState step(const ContactState& from, const Pose& to, double dt_s) const {
    return step(from, to, dt_s, {}, {});
  }
  /// The same with substeps that also end at the given instants. `at` is either empty or receives
  /// the contact at each of them.
  [[nodiscard]] ContactState step(const ContactState& from, const Pose& to, double dt_s,
                                  const Instants& instants, std::span<SlidingContact> at) const;

 private:
  struct Span;
  struct Leg;
  struct Motion;
  struct Pressed;

  [[nodiscard]] Approach approach(const ContactState& from, const Pose& to, double dt_s) const;
  [[nodiscard]] Motion begin(const ContactState& from, const Approach& approach) const;
  [[nodiscard]] ContactState finish(const ContactState& from, const Pose& to, const Motion& motion,
                                    const Approach& approach, double dt_s) const;
  void travel(Motion& motion, const Approach& path, double dt_s, const Instants& instants,
              std::span<SlidingContact> at) const;
  [[nodiscard]] Leg leg(double length_s, double step_s) const;
  void go(Motion& motion, const Approach& path, double t_s, const Leg& leg) const;
  void cover(Motion& motion, const Approach& path, double t_s, double length_s) const;
  [[nodiscard]] double substep_s(const Motion& motion, const Approach& path, double t_s,
                                 double length_s, double step_s) const;
  [[nodiscard]] double substep_of_press_s(const Motion& motion, const Approach& path, double t_s,
                                          double length_s, double step_s) const;
  [[nodiscard]] double substep_of_glide_s(const Motion& motion, const Approach& path,
                                          double step_s) const;
  [[nodiscard]] SlidingContact seen(const Motion& motion, const Approach& path, double t_s) const;
  [[nodiscard]] SlidingContact contact_at_rest(const ContactState& state) const;
  [[nodiscard]] double stiffness_n_m(double normal_n) const;
  void advance(Motion& motion, const Approach& approach, double t_s, const Span& whole) const;
  [[nodiscard]] Pressed press(const Motion& motion, const Approach& approach, double t_s,
                              const Span& span) const;
  [[nodiscard]] Pressed press_midpoint(const Motion& motion, const Approach& approach, double t_s,
                                       const Span& span) const;
  [[nodiscard]] Pressed press_tr_bdf2(const Motion& motion, const Approach& approach, double t_s,
                                      const Span& span) const;
  [[nodiscard]] double exponent_after(const Motion& motion, const Approach& approach, double t_s,
                                      double after_s, double z_m) const;
  [[nodiscard]] PressStage stage_after(const Motion& motion, const Approach& approach, double t_s,
                                       double after_s, const PressMemory& memory,
                                       const RelaxationStep& relaxation,
                                       const PressRates& rates) const;
  [[nodiscard]] double event_share(const Motion& motion, const Approach& approach, double t_s,
                                   double h_s, double exponent_at_end) const;
  void settle_memory(PressMemory& memory, double exponent, const RelaxationStep& relaxation) const;
  void glide(Motion& motion, const Approach& approach, double h_s, const Pressed& pressed) const;
  [[nodiscard]] LuGre friction(double normal_n, NearPower& power) const;
  [[nodiscard]] Vector2 friction_n(const Motion& motion, const Approach& approach) const;
  [[nodiscard]] double force_n(const PressMemory& memory) const;

  ContactModel statics_;
  ContactGeometry geometry_;
  ContactMaterial material_;
  DynamicsParams params_;
  PressLaw law_;
  GlideLaw glide_law_;
  double kinetic_at_reference_n_;  ///< F_C at the reference load
};

}  // namespace weft::sim
