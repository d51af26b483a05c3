#pragma once
// The parts that report.json and the command line's --json have in common, in one shape.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "classifier/evaluate/evaluate.hpp"
#include "daemon/analysis/report/core_rows.hpp"
#include "daemon/campaign/campaign.hpp"
#include "daemon/campaign/simulation.hpp"

namespace weft::daemon {

// How a campaign was simulated, in words: for the terminal, the page and report.json.

/// "Simulated at level L1 3.072 ms because the scene needs a wrench and taxel counts; error against
/// L2 midpoint 0.2 ms: max 12.1 mN, rms 3.0 mN": the last of the errors, which knows most. Empty
/// on a bench that is not simulated.
std::string sentence(const SimulationNote& note);
/// One line for each error.
std::vector<std::string> error_lines(const SimulationNote& note);
/// Both for a terminal: at most 80 columns, each line ends with a newline.
std::string simulation_text(const SimulationNote& note);

/// Accuracy, interval and its method, accuracy of each split, times, and the confusion matrix as
/// {"labels": [...], "count": [[...]]}: a row per true label, a column per answer.
nlohmann::ordered_json evaluation_json(const classifier::Scores& evaluation);

/// One pair of fabrics: selected features with p, parameters, errors of the cross-validation.
nlohmann::ordered_json core_json(const CoreLine& line);

nlohmann::ordered_json tally_json(const ForceTally& tally);

/// [{"label", "exploration", "trials"}]: what a live vote left out; empty as a rule.
nlohmann::ordered_json ended_early_json(const DatasetInfo& info);

/// Which positions of each stage a plan uses, and how far they stay from the ends of its travel:
/// {"z": {"min_m", "max_m", "margin_m"}, "rx": {"min_rad", ...}, ...}.
nlohmann::json envelope_json(const recipes::Forecast& forecast);

/// How the run went. "error" is the first problem's sentence, or null.
nlohmann::ordered_json run_json(const CampaignSummary& run);

}  // namespace weft::daemon
