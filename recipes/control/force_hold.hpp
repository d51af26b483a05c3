#pragma once
// Holds a force that is nearly reached, as well as a stage on whole quanta can: the floor is the
// error of the nearest quantum, 1 um times the stiffness over sqrt 12. Source:
// docs/reference/plant.md, Instruments and the force loop.
//
// A loop that answers every reading moves the stage by the sensor's noise, a quantum of force each
// time; one that leaves half a quantum alone errs by that and by the quantum. So the two questions
// are parted. What is the force? An observer of two states, the force and its drift (relaxation of
// the cloth, waves under the slide), corrected by the readings and told of the stage's own steps,
// which then need not be found again in the noise. Where should the stage stand? On the quantum
// nearest to the set point, and it moves only when that is another one.
//
// The observer has the poles of a steady Kalman filter for a drift that wanders, two at w (1 +- i)
// / sqrt 2. A cloth's waves weigh by its stiffness, hence w ~ sqrt K; until it has learnt the drift
// it is quicker, w = learning / age.
//
// Where the contact is softer than believed (a probe that hangs by its stop has moved too little to
// measure it), the set point is more quanta away than it seems. A force that stays off is therefore
// answered by one quantum. Where that brings it further off on the other side the belief was right:
// the stage goes back, and stays.

#include <optional>

namespace weft::recipes {

struct ForceHoldConfig {
  double band_n = 0.1;    ///< from the set point; a reading further away ends the hold,
  double quiet_n = 0.06;  ///< and so does one this far from what was expected: no noise
  double pole_radps = 3;  ///< w on a cloth (and mount) of the stiffness below
  double pole_stiffness_npm = 15e3;
  double learning = 6;  ///< w of a hold that began 1 s ago
  double slowest_radps = 1, fastest_radps = 20;
  double lead_s = 0.05;     ///< from a reading's instant to the middle of the stage's answer
  double step_s = 0.1;      ///< in which the stage makes its way, by a velocity that ends by itself
  double offset_n = 0.03;   ///< more than noise: a stage that stands this far off for
  double patience_s = 0.5;  ///< this long tries one quantum more
};

struct ForceHoldState {
  bool active = false;
  double force_n = 0;    ///< believed now
  double drift_nps = 0;  ///< of the force where the stage stands
  double age_s = 0;
  double uncorrected_s = 0;  ///< since a reading came
  double z_m = 0;            ///< quantum on which the stage stood at the last step
  double target_m = 0;       ///< and the one on which it shall stand
  double still_s = 0;        ///< since the target changed
  double moved = 0;          ///< sign of the last move; 0: none
};

struct ForceHoldInput {
  double setpoint_n = 0;
  double force_n = 0;  ///< reading
  bool fresh = true;   ///< false: no reading came, force_n is that of the last step
  double z_m = 0;      ///< of the stage, counted downwards
  double dt_s = 0;
  double stiffness_npm = 0;  ///< of cloth and mount in series, as it is believed
  double quantum_m = 0;      ///< of the stage
};

/// One cycle: the velocity of z, positive downwards, [m/s]; nothing where the force is not nearly
/// reached or moves by more than noise, and then the hold has ended. One that begins takes
/// `state.drift_nps` for the drift.
std::optional<double> hold_force(const ForceHoldConfig& config, ForceHoldState& state,
                                 const ForceHoldInput& input);

}  // namespace weft::recipes
