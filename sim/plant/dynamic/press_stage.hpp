#pragma once
// One implicit stage of the probe's motion along z: Newton's law at one instant,
//   m a = weight + mount force + damper - cloth force,
// with velocity and acceleration linear in the displacement d that is looked for. Implicit midpoint
// and both stages of TR-BDF2 have this form, with the cloth's memory advanced exactly to that
// instant. The residual falls monotonically in d, so that there is one root at any step.

#include "sim/plant/contact.hpp"

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

}  // namespace weft::sim
