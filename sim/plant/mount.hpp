#pragma once
// The probe's mount. The probe rides in a guide on the z stage: it can be pushed up against a
// spring (the sensor's and mount's compliance), rests freely inside a slack, and hangs on a stop
// below it. Inside the slack the stage does nothing to the force: the cloth carries the probe's own
// weight, which is phase S of Khan et al. 2016.

#include "protocols/base/units.hpp"

namespace weft::sim {

struct Mount {
  double mass_kg = 0.2;             ///< [E]
  double stiffness_n_m = 2e4;       ///< k_c, series compliance [E]
  double slack_m = 0.5e-3;          ///< [E]
  double stop_stiffness_n_m = 2e5;  ///< of the stop the probe hangs on [E]

  [[nodiscard]] double weight_n() const { return mass_kg * standard_gravity_mps2; }

  /// Force of the mount on the probe, downwards, at `extension_m` = z_stage - z_probe.
  [[nodiscard]] double force_n(double extension_m) const {
    if (extension_m > 0) return stiffness_n_m * extension_m;
    if (extension_m >= -slack_m) return 0;
    return stop_stiffness_n_m * (extension_m + slack_m);
  }
  [[nodiscard]] double slope_n_m(double extension_m) const {
    if (extension_m > 0) return stiffness_n_m;
    return extension_m >= -slack_m ? 0 : stop_stiffness_n_m;
  }
  /// Extension of a probe that hangs free.
  [[nodiscard]] double hanging_extension_m() const {
    return -slack_m - weight_n() / stop_stiffness_n_m;
  }
};

}  // namespace weft::sim
