#pragma once
// The same minutes of a bench again, at another fidelity: the plant alone, driven along the motion
// that the stages made. Where a force loop was at work its answer belongs to the run: the stage
// that presses can be led so that the force follows the run's, slowly, as a loop would. What is
// left is what the data of the two would differ by.

#include <array>
#include <cstdint>
#include <vector>

#include "sim/devices/bench_motion.hpp"
#include "sim/devices/run_error.hpp"
#include "sim/plant/plant.hpp"

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

/// The same with the z stage led by an integrator: its force follows the normal forces of `run`
/// within lead_time_s or, where the cloth is soft against the mount, some times that. Where the
/// run's force is not above the probe's weight no loop is at work, and the stage goes back to its
/// own motion.
Replayed replay_led(const PlantParams& params, std::uint64_t rig_seed, const BenchMotion& motion,
                    const Replayed& run);
constexpr double lead_time_s = 0.1;  ///< three times that of the bench's loop, four frames

/// `run` and `finer` are of one motion; `counted` tells which samples count, all where it is empty.
RunError difference(const Replayed& run, const Replayed& finer,
                    const std::vector<bool>& counted = {});

/// The motion at the setting of `params` against each of finer_than() it. Level L0, whose force is
/// given, leads nothing: there both are along the same motion. `sampled`: when samples were taken
/// that count; each is of the frame that ended last before it. Empty: all count.
std::vector<RunError> run_errors(const PlantParams& params, std::uint64_t rig_seed,
                                 const BenchMotion& motion,
                                 const std::vector<TimePoint>& sampled = {});

}  // namespace weft::sim
