#pragma once
// What `weft evaluate` found on recordings of sound and vibration, as one page.

#include <string>
#include <utility>
#include <vector>

#include "classifier/vibro/cross_validation.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

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
