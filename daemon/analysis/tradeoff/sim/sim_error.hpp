#pragma once
// How far one run is from another of the same scene.

#include <optional>
#include <string>

#include "daemon/analysis/tradeoff/sim/sim_run.hpp"

namespace weft::daemon {

/// Largest and root mean square over the samples.
struct SimDeviation {
  double max = 0;
  double rms = 0;
};

struct SimError {
  SimDeviation force_n;              ///< of the force as a vector: normal and both tangential parts
  SimDeviation normal_n;             ///< of its normal part
  std::optional<SimDeviation> pads;  ///< of all pads, where both runs have counts [LSB]
  std::optional<double>
      touch_s;  ///< largest of the touch-downs; nothing without or where some miss
};

/// Both runs have the case's samples.
SimError measure_error(const SimTrace& run, const SimTrace& reference);

/// What level L3 knows beyond L2: the force that the surface's waves and asperities add on the
/// plate where the face is at a run's samples. Nothing of it for a scene without sliding.
Result<SimDeviation> rubbing_force(const SimCase& one, const SimTrace& run);

/// Why a run counts as failed; empty for one that does not. `one` is the scene's.
std::string find_failure(const SimCase& one, const SimTrace& run, const SimTrace& reference);

}  // namespace weft::daemon
