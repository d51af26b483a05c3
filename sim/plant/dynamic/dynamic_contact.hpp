#pragma once
// Level L2 of the probe on the fabric: inertia, LuGre friction, touch-down and lift-off. Fabric,
// mount and waviness are those of level L1 (contact.hpp). For slow motion it converges to L1.
//
// Along z the probe moves in the bench frame (PressStage); along x and y it lags behind the stages
// (GlideLaw, lugre.hpp). The two are coupled at the middle of the step: the normal force there
// determines the friction, and the face's position there the height of the fabric.

#include <cstddef>
#include <cstdint>
#include <span>

#include "sim/plant/contact.hpp"
#include "sim/plant/dynamic/lugre.hpp"
#include "sim/plant/fabric_law.hpp"
#include "sim/plant/near.hpp"

namespace weft::sim {

/// Memory of the fabric at the start of a stage.
struct PressMemory {
  double exponent = -1e9;  ///< s; above 0: contact
  double growth = 0;       ///< e^s in contact, 1 at first touch
  double branch = -1;
  RelaxationState relaxation;
};

/// Constants of all stages.
struct PressLaw {
  double lambda_m = 1;
  double top_n = 0;               ///< force of the law per unit of e^s - 1: face area times p_s
  double largest_exponent = 700;  ///< the law is constant above
  Hysteresis hysteresis;
  Mount mount;
  double damper_n_s_m = 0;
  // Precomputed quotients of the above.
  double per_lambda = 1 / lambda_m, per_length = 1 / hysteresis.length;
  double turn = hysteresis.eta / (1 + hysteresis.eta);

  /// e^s, limited at the largest exponent.
  [[nodiscard]] double growth(const PressMemory& memory, double s) const;
  /// Branch of the hysteresis.
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
///   m a = weight + mount force + damper - fabric force,
/// with velocity and acceleration linear in the unknown displacement d. Implicit midpoint and both
/// stages of TR-BDF2 have this form, with the memory of the fabric advanced exactly to that
/// instant. The residual decreases monotonically in d, so that there is one root for any step.
struct PressStage {
  const PressLaw& law;
  const PressMemory& memory;
  const RelaxationStep& relaxation;  ///< from the instant of the memory to this one
  double z_m, stage_z_m, stage_mps;  ///< z of the probe, from which d counts
  double exponent_at_z;              ///< s at this instant for d = 0
  PressRates rates;

  struct Value {
    double residual_n, slope_n_m;
    double exponent, growth, elastic_n, force_n, branch;  ///< of the fabric
  };

  /// The root and its values; `d_m` is the guess and becomes the root.
  Value solve(double& d_m) const;

 private:
  [[nodiscard]] Value at(double d_m, double offset_n) const;
  [[nodiscard]] double highest_m(double offset_n) const;
  [[nodiscard]] Value follow(const Value& from, double d_m, double ds, double offset_n) const;
};

enum class Integrator : std::uint8_t {
  midpoint,  ///< implicit midpoint with exact memory: preserves undamped motion; for fine steps
  tr_bdf2,   ///< L-stable: damps motion that the step does not resolve; for coarse steps
  adaptive   ///< implicit midpoint with longer substeps while the contact is calm
};

/// Parameters of level L2 beyond L1: the probe's inertia, its guide, and friction that decreases
/// with speed. Source: docs/reference/plant.md, Contact law, Friction, Integrators.
struct DynamicsParams {
  /// Upper limit of the equal substeps; nothing else depends on it. For the adaptive integrator it
  /// is their length while the probe oscillates. The default is a sixteenth of a pad's conversion
  /// (error and cost: tests/bench/plant_levels.cc).
  double step_s = 192e-6;
  Integrator integrator = Integrator::adaptive;
  double normal_damping = 0.05;        ///< ratio of the mount's spring with the probe's mass [E]
  double lateral_stiffness_n_m = 1e5;  ///< k_l of guide and mount along x and y [E]
  double lateral_damping = 0.05;       ///< ratio, as above [E]
  double static_ratio = 1.2;           ///< F_S/F_C, 1.1 to 1.3 [E]
  double stribeck_speed_mps = 5e-3;    ///< v_s, 1 to 10 mm/s [E]
  /// Speed of the measurement of the fabric's friction: Friction::sliding_n is valid there (KES-FB4
  /// moves at 1 mm/s [E]).
  double friction_speed_mps = 1e-3;
  double bristle_damping = 0.3;  ///< ratio of the bristles with the probe's mass (sigma_1) [E]
  double viscous_n_s_m = 0;      ///< sigma_2 [E]
};

/// Refuses parameters for which the equations have no solution or doubles no range: NaN,
/// infinities, negative stiffness, steps outside 1 ns to 1 s, and so on. Errors: range, with the
/// name of the field.
Status check(const ContactGeometry& geometry, const Mount& mount, const ContactMaterial& material,
             const DynamicsParams& params);

/// Path of a probe during one step of the stages: their straight path, and the height at which its
/// face would just touch the fabric. The height is linear in time and in the position of the face.
struct Approach {
  double stage_z_m = 0;  ///< at the start of the step
  double stage_z_mps = 0;
  Vector2 stage_m{};        ///< x and y at the start of the step
  Vector2 stage_mps{};      ///< along x and y
  double touch_z_m = 0;     ///< z of the face's centre at first touch, at the start of the step
  double touch_mps = 0;     ///< its rate of change for a face with constant lag
  Vector2 touch_per_lag{};  ///< its change with the lag of the face [1]
  Vector2 lag_m{};          ///< lag for the values above

  [[nodiscard]] double stage_at(double t_s) const { return stage_z_m + stage_z_mps * t_s; }
  [[nodiscard]] double touch_at(double t_s, const Vector2& lag) const {
    return touch_z_m + touch_mps * t_s + touch_per_lag[0] * (lag[0] - lag_m[0]) +
           touch_per_lag[1] * (lag[1] - lag_m[1]);
  }
};

/// Instants within a step of the stages: `first_s`, then every `every_s`; `count` of them, none
/// after the end of the step.
struct Instants {
  double first_s = 0, every_s = 0;
  std::size_t count = 0;
};

class DynamicContact {
 public:
  /// The parameters must pass check().
  DynamicContact(const ContactGeometry& geometry, const Mount& mount,
                 const ContactMaterial& material, const DynamicsParams& params);

  /// The state `dt_s` later with the stages at `to`, moved there in a straight line. Substeps are
  /// equal and at most `step_s` (no more than 1e8 of them); those of the adaptive integrator are as
  /// long as the motion allows (dynamic_press.cpp). A substep in which the face touches or leaves
  /// the fabric is divided there. With less than 1 ps the stages jump and the probe keeps its
  /// position.
  /// A pose that is not finite or further than 1 km away, a negative dt_s and one above an hour
  /// change nothing.
  [[nodiscard]] ContactState step(const ContactState& from, const Pose& to, double dt_s) const {
    return step(from, to, dt_s, {}, {});
  }
  /// The same with substeps that also end at the given instants. `at` is empty or receives the
  /// contact at each of them.
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
