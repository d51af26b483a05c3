#pragma once
// The same minutes of a bench again, at another fidelity: the plant alone, driven along the motion
// that the stages made. What differs is the plant's doing; a controller that would have answered
// otherwise is not in it.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "sim/devices/bench_motion.hpp"
#include "sim/plant/fidelity/setting.hpp"

namespace weft::sim {

/// At the ends of the pads' frames, which are the sensor's sample times.
struct Replayed {
  std::vector<double> normal_n;
  std::vector<Vector2> friction_n;
  std::vector<std::array<std::uint16_t, pad_count>> counts;
};

/// With `params` and `rig_seed` of the bench that made the motion: what happened there, bit for
/// bit.
Replayed replay(const PlantParams& params, std::uint64_t rig_seed, const BenchMotion& motion);

/// Differences of a run from a finer one, over the samples in which either touches the cloth.
struct RunError {
  std::string setting, reference;  ///< "L1 3.072 ms", "L2 midpoint 0.2 ms"
  std::size_t samples = 0;
  double force_max_n = 0;  ///< normal force
  double force_rms_n = 0;
  double friction_max_n = 0;  ///< length of the difference of two vectors
  double friction_rms_n = 0;
  double counts_max = 0;  ///< of one pad
  double counts_rms = 0;
};

/// `run` and `finer` are of one motion.
RunError difference(const Replayed& run, const Replayed& finer);

/// The motion at the setting of `params` against each of finer_than() it.
std::vector<RunError> run_errors(const PlantParams& params, std::uint64_t rig_seed,
                                 const BenchMotion& motion);

}  // namespace weft::sim
