#pragma once
// How far a run is from a finer simulation of the same minutes (replay.hpp).

#include <cstddef>
#include <string>

namespace weft::sim {

/// Differences of a run from a finer one that is led by it, over the samples that are counted:
/// those that were recorded, and in which either touches the cloth.
struct RunError {
  std::string setting, reference;  ///< "L1 3.072 ms", "L2 midpoint 0.2 ms"
  std::size_t samples = 0;
  double force_max_n = 0;  ///< normal force
  double force_rms_n = 0;
  double friction_max_n = 0;  ///< length of the difference of two vectors
  double friction_rms_n = 0;
  bool pads = true;       ///< counts were compared: the rig has pads
  double counts_max = 0;  ///< of one pad
  double counts_rms = 0;
  /// Normal force, in samples that were not recorded too: touch-down, ramps and lift-off, where the
  /// two part by a few milliseconds.
  double anywhere_max_n = 0;
  double unled_max_n = 0;  ///< normal force, where the finer run makes the very same motion
  double unled_rms_n = 0;
};

}  // namespace weft::sim
