#pragma once
// Data behind the results: one trial as curves over time (force, taxels, phases), and the force
// errors of all trials, recomputed from the recorded wrench.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/campaign/trial_recording.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/phase.hpp"

namespace weft::daemon {

/// Consecutive taxel samples of one phase [s from the trial's first sample].
struct PhaseSpan {
  Phase phase = Phase::none;
  double begin_s = 0;
  double end_s = 0;
};

struct TracePoint {
  double x = 0;
  double y = 0;
};

struct Curve {
  std::vector<double> t_s;
  std::vector<double> value;
};

struct TrialTrace {
  const TrialRecord* record = nullptr;
  std::vector<PhaseSpan> phases;
  Curve normal_n;           ///< Fz, sensor frame, positive when pressing
  Curve tangential_n;       ///< sqrt(Fx^2 + Fy^2)
  std::vector<Curve> pads;  ///< counts above the taxel's mean in phase S (without S, above its
                            ///< first sample)
};

/// The complete trial of `exploration` with the median force error, so that the picture is neither
/// the best nor the worst. Trials without a wrench sort last. Nothing without complete trials.
std::optional<std::size_t> typical_trial(const Dataset& dataset, std::string_view exploration);

TrialTrace extract_trace(const Dataset& dataset, std::size_t trial);

/// At most about 2 x `buckets` points: minimum and maximum of each time bucket, so that no peak is
/// lost. A point that is not finite marks a pause of more than 0.15 s.
std::vector<TracePoint> thinned(const Curve& curve, std::size_t buckets);

/// Set point of one exploration, from the recipe that was run.
struct ForceTarget {
  std::string exploration;
  double force_n = 0;
  double band_n = 0;
  Phase phase = Phase::motion;  ///< phase in which the force is evaluated: P for a press
};

/// Empty if the data set has no readable recipe and rig.
std::vector<ForceTarget> force_targets(const DatasetInfo& info);
std::optional<ForceTarget> find_target(const std::vector<ForceTarget>& targets,
                                       std::string_view exploration);

/// Share of the samples in the band; 0 without samples.
double in_band_share(const ForceTally& tally);

struct FabricForce {
  std::string fabric;
  std::size_t trials = 0;
  ForceTally tally;
  std::optional<RestForces> rest = {};  ///< the means furthest from the weight; none: not measured
};

/// Complete trials by fabric, in order of their first trial. Uses wrench samples between the first
/// and the last taxel sample of phase M. Compared with the run's own tally, up to one taxel period
/// is missing at either end.
std::vector<FabricForce> force_by_fabric(const Dataset& dataset,
                                         const std::vector<ForceTarget>& targets);

}  // namespace weft::daemon
