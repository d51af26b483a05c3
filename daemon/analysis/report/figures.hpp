#pragma once
// The report's line and bar figures, each an <svg> of its own.

#include <optional>
#include <string>
#include <vector>

#include "daemon/analysis/report/evaluate_campaign.hpp"
#include "daemon/analysis/report/force_quality.hpp"
#include "daemon/analysis/report/report.hpp"
#include "daemon/analysis/report/trace.hpp"
#include "daemon/campaign/campaign.hpp"

namespace weft::daemon {

// The sections of report.html, each a piece of markup.

/// "SIMULATED", "REAL BENCH" or "BENCH UNKNOWN"; and "INCOMPLETE, 12 of 680 trials" where that is
/// so.
std::string badge_html(const ReportInput& input);

/// Style of the paper: the campaign's name and its bench at the head of every page.
std::string paper_style(const ReportInput& input);
std::string heading_section(const ReportInput& input);  ///< title, honesty note, tiles
std::string trace_section(const ReportInput& input);
std::string accuracy_section(const ReportInput& input);
std::string core_section(const ReportInput& input);
std::string timing_section(const ReportInput& input);
std::string force_section(const ReportInput& input);
std::string certificate_section(const ReportInput& input);  ///< of a report made afterwards
std::string wall_time_section(const ReportInput& input);
std::string provenance_section(const ReportInput& input);

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
