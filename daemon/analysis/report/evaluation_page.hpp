#pragma once
// What `weft evaluate` found, as one page: Tables II to IV, probabilities, curves, groups left out.

#include <string>
#include <utility>
#include <vector>

#include "classifier/evaluate/evaluate.hpp"
#include "daemon/analysis/report/evaluation_figures.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// One learner of the evaluation.
struct EvaluatedLearner {
  std::string name;
  classifier::LearnerEvaluation evaluation;
  std::string chosen;  ///< what a choice came to; empty for a learner that is none
};

/// Accuracy of each learner on one group left out.
struct GroupLeftOut {
  std::string group;
  std::size_t trials = 0;
  std::vector<double> accuracy;  ///< in the order of the learners
};

/// The page reads no clock, file or machine of its own.
struct EvaluationPage {
  BenchKind bench = BenchKind::unknown;
  std::string dataset;
  std::vector<std::pair<std::string, std::string>> facts;  ///< name and value, plain text
  double feature_s_per_sample = 0.0;                       ///< 0: not measured
  const std::vector<EvaluatedLearner>& learners;
  const std::vector<GroupLeftOut>& groups;  ///< may be empty
  const std::vector<CurvePoint>& curve;     ///< may be empty
};

/// One file without scripts or outside resources; every figure and table bears the bench's word.
std::string evaluation_html(const EvaluationPage& page);

/// Bins of a reliability as rows of plain text, below their heading: "0.9 to 1.0", answers, of so
/// many recordings, said, right, interval.
std::vector<std::vector<std::string>> reliability_rows(const classifier::CalibrationCheck& check);

/// How the intervals of these rows were computed, each method once.
std::string bin_methods(const classifier::CalibrationCheck& check);

/// "0.041 (0.032 to 0.060), Brier 0.12": the calibration error with its interval.
std::string format_calibration(const classifier::CalibrationCheck& check);

}  // namespace weft::daemon
