#pragma once
// Holds a force that is nearly reached, as well as a stage with whole quanta can. The limit is the
// error of the nearest quantum, 1 um times the stiffness over sqrt 12. Source:
// docs/reference/plant.md, Instruments and the force loop.
//
// A loop that reacts to every reading moves the stage by the sensor's noise, one quantum of force
// each time. A loop that ignores half a quantum has that error and the error of the quantum.
// Therefore two questions are separated.
// 1. The force: an observer estimates it and its drift (relaxation of the fabric, waves during the
// stroke). Readings correct it. The stage's own steps are an input, so they need not be found in
// the noise.
// 2. The stage position: the quantum nearest to the set point. The stage moves only when that
// quantum changes.
//
// The observer has the poles of a steady Kalman filter for a random-walk drift: two at w (1 +- i) /
// sqrt 2. The waves of a fabric scale with its stiffness, hence w ~ sqrt K. Until it has learnt the
// drift it is faster, w = learning / age.
//
// If the contact is softer than assumed, the set point is more quanta away than estimated. This
// happens to a probe that hangs on its stop: it has moved too little to measure the stiffness. A
// lasting error is therefore corrected by one quantum. If that gives a larger error on the other
// side, the estimate was right: the stage returns and stays.

#include <optional>

namespace weft::recipes {

struct ForceHoldConfig {
  double band_n = 0.1;    ///< from the set point; a reading further away ends the hold
  double quiet_n = 0.06;  ///< from the expected force; one further away is no noise and ends it
  double pole_radps = 3;  ///< w at the stiffness below (fabric and mount)
  double pole_stiffness_npm = 15e3;
  double learning = 6;  ///< w = learning / age [rad]
  double slowest_radps = 1, fastest_radps = 20;
  double lead_s = 0.05;     ///< from the time of a reading to the middle of the stage's response
  double step_s = 0.1;      ///< duration of a move, by a velocity that ends by itself
  double offset_n = 0.03;   ///< more than noise; an error above this
  double patience_s = 0.5;  ///< for this long makes the stage try one more quantum
};

struct ForceHoldState {
  bool active = false;
  double force_n = 0;    ///< estimate of the force now
  double drift_nps = 0;  ///< drift of the force at constant stage position
  double age_s = 0;
  double uncorrected_s = 0;  ///< since the last reading
  double z_m = 0;            ///< quantum of the stage at the last step
  double target_m = 0;       ///< quantum that the stage should reach
  double still_s = 0;        ///< since the target changed
  double moved = 0;          ///< sign of the last move; 0 if none
};

struct ForceHoldInput {
  double setpoint_n = 0;
  double force_n = 0;  ///< reading
  bool fresh = true;   ///< false: no new reading, force_n is that of the last step
  double z_m = 0;      ///< stage position, counted downwards
  double dt_s = 0;
  double stiffness_npm = 0;  ///< estimate for fabric and mount in series
  double quantum_m = 0;      ///< step of the stage
};

/// One cycle. Returns the velocity of z, positive downwards [m/s]. Returns nullopt, and the hold
/// ends, when the force is not nearly reached or moves by more than noise. A new hold starts with
/// `state.drift_nps` as its drift.
std::optional<double> hold_force(const ForceHoldConfig& config, ForceHoldState& state,
                                 const ForceHoldInput& input);

}  // namespace weft::recipes
