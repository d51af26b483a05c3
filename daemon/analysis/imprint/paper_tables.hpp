#pragma once
// What Ellis 1986 printed (sections 3.4.1 to 3.4.4): right answers out of 24.

#include <optional>
#include <span>
#include <vector>

#include "classifier/imprint/experiments.hpp"
#include "classifier/imprint/scale_features.hpp"

namespace weft::daemon {

inline constexpr std::size_t ellis_imprints = 24;

struct EllisEntry {
  bool converged;
  std::size_t correct;
};
/// Nothing where the paper has no such entry.
std::optional<EllisEntry> ellis_entry(classifier::imprint::Experiment experiment,
                                      std::span<const double> sigmas,
                                      classifier::imprint::Form form);

/// The paper's sets of scales: 0; 1; 2; 3; 1, 2; 1, 3; 1, 2, 4.
std::vector<std::vector<double>> ellis_scales();

}  // namespace weft::daemon
