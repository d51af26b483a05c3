#pragma once
// Cells of tables of accuracies, as markup.

#include <string>
#include <vector>

#include "daemon/analysis/report/evaluate_campaign.hpp"

namespace weft::daemon {

/// Per cent, below it the interval.
std::string interval_html(const classifier::Scores& scores);
/// The same of one of the results, or a dash.
std::string accuracy_html(const std::vector<ReductionResult>& results,
                          classifier::Reduction reduction);
/// What the paper printed; negative: nothing.
std::string printed_share_html(double share);

}  // namespace weft::daemon
