#pragma once
// Tables 1 and 2 and Figure 4 of the 2023 paper, with its figures beside ours.

#include <string>

#include "daemon/analysis/tradeoff/measure_vibro.hpp"

namespace weft::daemon {

/// Table 1 (F-score for windows of 1 s and 2 s; rows of features that were measured) and the
/// averages behind Figure 4, each cell: ours on random windows, ours on what is left out whole, the
/// paper's where it prints one. Then Table 2: the share of right answers for each material over all
/// learners, and what it is taken for. Of the source with most channels. `badge_html`: of the
/// bench, on every table.
std::string vibro_tables_html(const VibroTradeoff& tradeoff, const std::string& badge_html);

}  // namespace weft::daemon
