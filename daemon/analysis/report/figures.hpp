#pragma once
// The report's line and bar figures, each an <svg> of its own.

#include <optional>
#include <string>
#include <vector>

#include "daemon/analysis/report/evaluate_campaign.hpp"
#include "daemon/analysis/report/force_quality.hpp"
#include "daemon/analysis/report/trace.hpp"
#include "daemon/campaign/campaign.hpp"

namespace weft::daemon {

/// Normal and tangential force over time, phases shaded, set point and band when known.
std::string force_figure(const TrialTrace& trace, const std::optional<ForceTarget>& target);

/// Range of all pads together, so that the small pictures compare.
svg::Range pad_range(const TrialTrace& trace);
/// One pad's counts over time, phases shaded. `pad` counts from 0.
std::string pad_figure(const TrialTrace& trace, std::size_t pad, const svg::Range& range);

/// Accuracy with its interval for each exploration and reduction; the paper's as hollow diamonds.
std::string accuracy_figure(const std::vector<ExplorationResult>& results);

/// RMS and worst force error of each fabric against the band.
std::string fabric_force_figure(const std::vector<FabricForce>& fabrics,
                                std::optional<double> band_n);

struct Share {
  std::string name;
  double seconds = 0;
};
/// The parts of the run's wall time; what was not attributed is the last part.
std::vector<Share> wall_shares(const CampaignSummary& run);
std::string share_figure(const std::vector<Share>& shares);

}  // namespace weft::daemon
