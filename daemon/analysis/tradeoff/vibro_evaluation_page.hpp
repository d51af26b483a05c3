#pragma once
// What `weft evaluate` found on recordings of sound and vibration, as one page.

#include <string>
#include <utility>
#include <vector>

#include "classifier/vibro/cross_validation.hpp"
#include "daemon/analysis/tradeoff/measure_vibro.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Table 1 (F-score for windows of 1 s and 2 s; rows of features that were measured) and the
/// averages behind Figure 4, each cell: ours on random windows, ours on what is left out whole, the
/// paper's where it prints one. Then Table 2: the share of right answers for each material over all
/// learners, and what it is taken for. Of the source with most channels. `badge_html`: of the
/// bench, on every table.
std::string vibro_tables_html(const VibroTradeoff& tradeoff, const std::string& badge_html);

/// One learner, or the choice among several.
struct EvaluatedMethod {
  std::string name;  ///< "kNN", "best"
  classifier::vibro::CrossValidation result;
};

/// Intervals of the methods are shown as they are named.
struct VibroEvaluation {
  BenchKind bench = BenchKind::unknown;
  std::string dataset, sha256;
  std::vector<std::pair<std::string, std::string>> facts;  ///< name and value, plain text
  double window_s = 0, features_s = 0;                     ///< features_s: of one window, measured
  std::vector<EvaluatedMethod> methods;
  std::string importance;  ///< plain text; may be empty
};

/// F-score against the time of an answer, shares of windows and recordings with their intervals,
/// confusion by material of each learner. One file without scripts or outside resources; every
/// figure bears the bench's word. Refuses no learners and figures that are not finite.
Result<std::string> vibro_evaluation_html(const VibroEvaluation& evaluation);

}  // namespace weft::daemon
