#pragma once
// Cells of accuracy tables, as HTML.

#include <string>
#include <vector>

#include "daemon/analysis/report/evaluate_campaign.hpp"

namespace weft::daemon {

/// Accuracy in per cent, with the interval below it.
std::string interval_html(const classifier::Scores& scores);
/// The same for one of the results, or a dash.
std::string accuracy_html(const std::vector<ReductionResult>& results,
                          classifier::Reduction reduction);
/// A value printed in the paper; empty if negative.
std::string printed_share_html(double share);

}  // namespace weft::daemon
