#pragma once
// The trials behind the figures: one as curves over time (force, pads, phases), and how well the
// force was held in all, computed again from the recorded wrench.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/campaign/trial_recording.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/phase.hpp"

namespace weft::daemon {

/// A run of taxel samples of one phase [s from the trial's first sample].
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
  Curve normal_n;           ///< Fz, sensor frame, pressing positive
  Curve tangential_n;       ///< sqrt(Fx^2 + Fy^2)
  std::vector<Curve> pads;  ///< counts above the pad's mean in phase S (its first sample without S)
};

/// The complete trial of `exploration` with the median force error, so that the picture is neither
/// the best nor the worst; trials without a wrench stand behind. Nothing without complete trials.
std::optional<std::size_t> typical_trial(const Dataset& dataset, std::string_view exploration);

TrialTrace extract_trace(const Dataset& dataset, std::size_t trial);

/// At most about 2 x `buckets` points: least and greatest value of each bucket of time, so that no
/// peak is lost. A point that is not finite marks a pause of more than 0.15 s.
std::vector<TracePoint> thinned(const Curve& curve, std::size_t buckets);

/// Set point of phase M of one exploration, from the recipe that was run.
struct ForceTarget {
  std::string exploration;
  double force_n = 0;
  double band_n = 0;
  Phase phase = Phase::motion;  ///< in which it is judged: P of a press
};

/// Empty when the data set carries no recipe and rig that can be read.
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

/// Complete trials, by fabric in order of their first trial. Wrench samples between the first and
/// the last taxel sample of phase M, so up to one taxel period is left out at either end compared
/// with the run's own tally.
std::vector<FabricForce> force_by_fabric(const Dataset& dataset,
                                         const std::vector<ForceTarget>& targets);

}  // namespace weft::daemon
