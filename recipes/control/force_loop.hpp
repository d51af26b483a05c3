#pragma once
// PI control of the normal force through the velocity of the z stage. The gain is scheduled by the
// contact stiffness, which is estimated on line. Source: docs/reference/plant.md, Contact law and
// Instruments and the force loop.
//
// The stage integrates: F' = K v. With v = g e / (K T) the loop gain per cycle is g for any fabric.
// It must stay under 1 with one cycle of delay and under 0.618 with two, so g is 0.3. K varies 120
// times between fabrics and a thousand times within one press, hence the schedule: v = g e / (K_est
// T).
//
// K_est is the least-squares slope of force against z over the last few moves of some micrometres,
// with forgetting. It starts high (low gain). Its lower limit is force / lambda, up to the
// stiffness of the mount: compression is exponential, F ~ exp(z / lambda), so K = F / lambda. No
// known fabric has lambda over 0.5 mm.
//
// Near the set point force_hold.hpp takes over: there the stage's quantum and the sensor's noise
// limit the accuracy of the force, not the speed of the loop.

#include "recipes/control/force_hold.hpp"

namespace weft::recipes {

struct ForceLoopConfig {
  double loop_gain = 0.3;        ///< g, per cycle
  double cycle_s = 0.01;         ///< T; a longer dt_s replaces it
  double integral_time_s = 1.0;  ///< integral time, for the relaxation of the fabric
  double max_speed_mps = 1e-3;   ///< clamp of the command
  double latency_s = 0.03;       ///< upper limit from the time of a reading to the stage's response
  double max_acceleration_mps2 = 20e-3;  ///< of the stage: it must be able to stop in time
  double position_quantum_m = 1e-6;  ///< step of the stage; errors under half a step are ignored
  /// At least the stiffness of the mount, which is in series with the fabric. For a hanging probe:
  /// at least that of its stop.
  double stiffness_initial_npm = 2e4;
  double stiffness_min_npm = 10;
  double stiffness_max_npm = 1e8;
  double lambda_max_m = 0.7e-3;  ///< longest compression length of any fabric on the plate
  ForceHoldConfig hold;
};

/// State of the loop. Use a new default-constructed one whenever the loop is switched on.
struct ForceLoopState {
  bool primed = false;
  double integral_n = 0;      ///< integral of the error over the integral time
  double stiffness_npm = 0;   ///< K_est, for display and journal
  double slope_zz_m2 = 0;     ///< least squares: sum of dz^2
  double slope_zf_nm = 0;     ///< least squares: sum of dz dF
  double anchor_force_n = 0;  ///< force at the start of the move that is measured
  double anchor_z_m = 0;
  double anchor_age_s = 0;
  ForceHoldState hold;
};

struct ForceLoopInput {
  double setpoint_n = 0;
  double force_n = 0;  ///< measured, positive when the probe pushes on the plate
  double z_m = 0;      ///< reported stage position, counted downwards
  double dt_s = 0;     ///< since the last step, > 0
  /// False during a stroke: the texture then changes the force without motion of z.
  bool learn_stiffness = true;
  bool fresh = true;  ///< false: no reading since the last step, force_n is that of the last step
};

struct ForceCommand {
  double velocity_mps = 0;  ///< of z, positive downwards
};

/// One cycle. Input that is not finite, or dt_s <= 0, gives velocity 0 and does not change the
/// state.
ForceCommand step(const ForceLoopConfig& config, ForceLoopState& state,
                  const ForceLoopInput& input);

/// True once the force error has stayed inside the band for the dwell time. With a dwell time of 0:
/// once it is inside.
struct SettleDetector {
  double band_n = 0;
  double dwell_s = 0;
  double inside_s = 0;

  bool step(double error_n, double dt_s);
};

}  // namespace weft::recipes
