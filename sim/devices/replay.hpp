#pragma once
// The same minutes of a bench again, at another fidelity: the plant alone, driven along the motion
// that the stages made. Where a force loop was at work its answer belongs to the run: the stage
// that presses can be led so that the force follows the run's, slowly, as a loop would. What is
// left is what the data of the two would differ by.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "sim/devices/bench_plant.hpp"
#include "sim/plant/plant.hpp"

namespace weft::sim {

/// Differences of a run from a finer one that is led by it, over the samples that are counted:
/// those that were recorded, and in which either touches the cloth. Where a force is no finite
/// number the difference is infinite.
struct RunError {
  std::string setting, reference;  ///< "L1 3.072 ms", "L2 tr_bdf2 0.05 ms"
  std::size_t samples = 0;
  double force_max_n = 0;  ///< normal force
  double force_rms_n = 0;
  double friction_max_n = 0;  ///< length of the difference of two vectors
  double friction_rms_n = 0;
  bool pads = true;       ///< counts were compared: both have them
  double counts_max = 0;  ///< of one pad
  double counts_rms = 0;
  /// Normal force, in samples that were not recorded too: touch-down, ramps and lift-off, where the
  /// two part by a few milliseconds.
  double anywhere_max_n = 0;
  double unled_max_n = 0;  ///< normal force, where the finer run makes the very same motion
  double unled_rms_n = 0;
  TimePoint worst_at{};     ///< of force_max_n: the grid point, on the bench's clock
  bool is_doubled = false;  ///< a second reference was played too
  /// Largest difference of the two references' normal forces, over the counted samples.
  double uncertainty_n = 0;
  /// The references agree well enough for the accuracy in question, or their difference does not
  /// matter: the error is above it by more.
  bool is_resolved = true;
};

/// When samples arrived that count: of the pads, and of the force sensor, which is read more often.
struct SampleTimes {
  std::vector<TimePoint> pads, wrench;
};

/// At the ends of the pads' frames, which are the sensor's sample times.
struct Replayed {
  std::vector<double> normal_n;
  std::vector<double> wrench_n{};  ///< normal force at the points asked for
  std::vector<Vector2> friction_n{};
  std::vector<std::array<std::uint16_t, pad_count>> counts{};  ///< empty for a plant without pads
};

/// With `params` and `rig_seed` of the bench that made the motion: what happened there, bit for
/// bit. `points`: of the motion's poses, ascending, at which `wrench_n` is wanted; see
/// wrench_points().
Replayed replay(const PlantParams& params, std::uint64_t rig_seed, const BenchMotion& motion,
                const std::vector<std::size_t>& points = {});

/// The same with the z stage led by an integrator: its force follows the normal forces of `run`
/// within lead_time_s or, where the cloth is soft against the mount, some times that. Where the
/// run's force is not above the probe's weight no loop is at work, and the stage goes back to its
/// own motion.
Replayed replay_led(const PlantParams& params, std::uint64_t rig_seed, const BenchMotion& motion,
                    const Replayed& run, const std::vector<std::size_t>& points = {});
constexpr double lead_time_s = 0.1;  ///< three times that of the bench's loop, four frames

/// Which of the motion's frames were sampled: of each sample the frame that ended last before it.
/// Empty, which is all, without samples.
std::vector<bool> counted_frames(const BenchMotion& motion, std::size_t frames,
                                 const std::vector<TimePoint>& sampled);

/// Of each sample of the force sensor the point of the motion's grid, 3 ms apart, that was last
/// before it; ascending like `sampled`.
std::vector<std::size_t> wrench_points(const BenchMotion& motion,
                                       const std::vector<TimePoint>& sampled);

/// `run` and `finer` are of one motion; `counted` tells which frames count, all where it is empty.
/// What both have in `wrench_n` counts too. Counts are compared where both have them. `worst_at` is
/// not set.
RunError difference(const Replayed& run, const Replayed& finer,
                    const std::vector<bool>& counted = {});

/// The force of the motion at the setting of `params` against its reference
/// (sim/plant/fidelity/reference.hpp), which computes no pads. Level L0, whose force is given,
/// leads nothing: there both are along the same motion. `sampled`: a sample of the pads is of the
/// frame that ended last before it, one of the force sensor of the last grid point. No pads: all
/// frames count. `accuracy_n`: of the force, that the error will be held against. With it two
/// references are played, which are made finer until they agree within trusted_share of it; without
/// it one, the quick one. A function of its arguments.
RunError run_error(const PlantParams& params, std::uint64_t rig_seed, const BenchMotion& motion,
                   const SampleTimes& sampled = {}, std::optional<double> accuracy_n = {});

}  // namespace weft::sim
