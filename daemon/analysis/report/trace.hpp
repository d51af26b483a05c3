#pragma once
// One trial as curves over time: force, pads, phases.

#include <cstddef>
#include <optional>
#include <string_view>
#include <vector>

#include "daemon/pages/plot/svg.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/phase.hpp"

namespace weft::daemon {

/// A run of taxel samples of one phase [s from the trial's first sample].
struct PhaseSpan {
  Phase phase = Phase::none;
  double begin_s = 0;
  double end_s = 0;
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
std::vector<svg::Point> thinned(const Curve& curve, std::size_t buckets);

}  // namespace weft::daemon
