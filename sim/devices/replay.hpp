#pragma once
// Simulates a period of a bench again at another fidelity: only the plant, driven along the
// recorded motion of the stages. If a force loop was active, its response belongs to the run. The
// pressing stage can therefore be led so that the force slowly follows the run's, as a loop would.
// The rest is the difference between the data of both.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim/devices/bench_plant.hpp"
#include "sim/plant/plant.hpp"

namespace weft::sim {

/// Differences of a run from a finer one that it leads. Samples count if they were recorded and
/// either run touches the fabric. If a force is not finite the difference is infinite.
struct RunError {
  std::string setting, reference;  ///< "L1 3.072 ms", "L2 tr_bdf2 0.05 ms"
  std::size_t samples = 0;
  double force_max_n = 0;  ///< normal force
  double force_rms_n = 0;
  double friction_max_n = 0;  ///< length of the difference of two vectors
  double friction_rms_n = 0;
  bool pads = true;       ///< counts were compared: both runs have them
  double counts_max = 0;  ///< of one pad
  double counts_rms = 0;
  /// Normal force, including samples that were not recorded: touch-down, ramps and lift-off, where
  /// the runs differ by a few milliseconds in time.
  double anywhere_max_n = 0;
  double unled_max_n = 0;  ///< normal force; the finer run follows the same motion, unled
  double unled_rms_n = 0;
  TimePoint worst_at{};     ///< time of force_max_n: the grid point, on the bench's clock
  bool is_doubled = false;  ///< a second reference was computed too
  /// Largest difference of the two references' normal forces, over the counted samples.
  double uncertainty_n = 0;
  /// The references agree well enough for the requested accuracy. Or their difference does not
  /// matter, because the error exceeds the accuracy by more than it.
  bool is_resolved = true;
};

/// Arrival times of the samples that count: pads, and the force sensor, which is read more often.
struct SampleTimes {
  std::vector<TimePoint> pads, wrench;
};

/// Forces and counts at the ends of the pads' frames, which are the sensor's sample times.
struct Replayed {
  std::vector<double> normal_n;
  std::vector<double> wrench_n{};  ///< normal force at the requested points
  std::vector<Vector2> friction_n{};
  std::vector<std::array<std::uint16_t, pad_count>> counts{};  ///< empty for a plant without pads
};

/// With `params` and `rig_seed` of the bench of the motion, repeats the run bit for bit. `points`:
/// ascending indices of the motion's poses for `wrench_n`; see wrench_points().
Replayed replay(const PlantParams& params, std::uint64_t rig_seed, const BenchMotion& motion,
                const std::vector<std::size_t>& points = {});

/// The same with the z stage led by an integrator. Its force follows the normal forces of `run`
/// within lead_time_s, or a multiple of it if the fabric is soft against the mount. If the run's
/// force is not above the probe's weight, no loop is active and the stage returns to its own
/// motion.
Replayed replay_led(const PlantParams& params, std::uint64_t rig_seed, const BenchMotion& motion,
                    const Replayed& run, const std::vector<std::size_t>& points = {});
constexpr double lead_time_s = 0.1;  ///< three times that of the bench's loop, four frames

/// Marks the frames of the motion that were sampled: for each sample the last frame that ended
/// before it. Empty, which means all, without samples.
std::vector<bool> counted_frames(const BenchMotion& motion, std::size_t frames,
                                 const std::vector<TimePoint>& sampled);

/// For each sample of the force sensor, the last point of the motion's grid (3 ms) before it;
/// ascending like `sampled`.
std::vector<std::size_t> wrench_points(const BenchMotion& motion,
                                       const std::vector<TimePoint>& sampled);

/// Difference of `run` and `finer`, which must be of one motion. `counted` marks the frames that
/// count; empty: all. Common elements of `wrench_n` count too. Counts are compared if both have
/// them. `worst_at` is not set.
RunError difference(const Replayed& run, const Replayed& finer,
                    const std::vector<bool>& counted = {});

/// Compares the force of the motion at the setting of `params` with its reference
/// (sim/plant/fidelity/reference.hpp), which computes no pads. Level L0 has a given force and leads
/// nothing: there both follow the same motion. Pure.
/// `sampled`: a sample of the pads belongs to the last frame that ended before it, one of the force
/// sensor to the last grid point. Without pad samples all frames count.
/// `accuracy_n`: the accuracy of the force to be checked. With it two references are computed, and
/// refined until they agree within trusted_share of it. Without it only the quick reference is
/// used.
RunError run_error(const PlantParams& params, std::uint64_t rig_seed, const BenchMotion& motion,
                   const SampleTimes& sampled = {}, std::optional<double> accuracy_n = {});

}  // namespace weft::sim
