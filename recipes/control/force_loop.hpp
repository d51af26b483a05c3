#pragma once
// PI control of the normal force by the velocity of the z stage, with the gain scheduled by the
// contact stiffness, which is estimated on line (reference/sim.md 1.1 and 1.3).
//
// The stage integrates: F' = K v. With v = g e / (K T) the loop gain per cycle is g whatever the
// fabric; it must stay under 1 with one cycle of delay and under 0.618 with two, so g is 0.3. K
// varies 120 times between fabrics and a thousand times within one press, hence the schedule: v = g
// e / (K_est T).

namespace weft::recipes {

struct ForceLoopConfig {
  double loop_gain = 0.3;         ///< g, per cycle of `design_cycle_s`
  double integral_time_s = 1.0;   ///< of the integral part, which removes the lag against creep
  double design_cycle_s = 0.01;   ///< the gain holds per this time; 1 / cycle rate
  double stiffness_min_npm = 50;  ///< bounds of the estimate [N/m]
  double stiffness_max_npm = 1e8;
  double stiffness_initial_npm = 2e4;  ///< conservative: high stiffness means low gain
  double max_speed_mps = 1e-3;         ///< clamp of the command
  double position_quantum_m =
      1e-6;  ///< of the stage; force errors under one quantum are left alone
};

struct ForceLoopState {
  double stiffness_npm = 0;   ///< estimate; 0 until the first cycle
  double integral_n_s = 0;    ///< of the force error
  double anchor_force_n = 0;  ///< where the present estimate's increment began
  double anchor_z_m = 0;
  bool primed = false;
};

struct ForceLoopInput {
  double setpoint_n = 0;
  double force_n = 0;  ///< measured, positive when the probe pushes on the plate
  double z_m = 0;      ///< reported stage position, counted downwards
  double dt_s = 0;     ///< since the last step, > 0
};

struct ForceCommand {
  double velocity_mps = 0;  ///< of z, positive downwards
};

/// One cycle. Input that is not finite, or dt_s <= 0, gives velocity 0 and leaves the state alone.
ForceCommand step(const ForceLoopConfig& config, ForceLoopState& state,
                  const ForceLoopInput& input);

/// True after the force error has stayed inside the band for the dwell time.
struct SettleDetector {
  double band_n = 0;
  double dwell_s = 0;
  double inside_s = 0;
  bool step(double error_n, double dt_s);
};

}  // namespace weft::recipes
