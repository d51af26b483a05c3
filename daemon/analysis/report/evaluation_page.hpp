#pragma once
// The results of `weft fabric evaluate` as one page: Tables II to IV, probabilities, learning
// curves, groups left out.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "classifier/evaluate/evaluate.hpp"
#include "daemon/pages/document/document.hpp"
#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// One learner at one number of training trials.
struct CurveValue {
  std::string learner;
  double accuracy = 0.0;
  double deviation = 0.0;     ///< over the draws
  classifier::Interval ci95;  ///< over the splits, using each split's mean over its draws
};
struct CurvePoint {
  std::size_t trials = 0;  ///< most trials per label
  std::size_t draws = 0;   ///< over all splits
  std::vector<CurveValue> values;
};

/// Accuracy against training trials per label: one line and mark per learner; bars show the
/// deviation over the draws. `curve` is sorted by number of trials; all points have the same
/// learners.
chart::Plot learning_curve(const std::vector<CurvePoint>& curve);

/// One learner of the evaluation.
struct EvaluatedLearner {
  std::string name;
  classifier::Evaluation evaluation;
  std::string chosen;  ///< the chosen recipes; empty if nothing was chosen
  std::optional<classifier::Scores> level_removed =
      {};  ///< each taxel's mean of phase M subtracted
};

/// Accuracy of each learner on one group left out.
struct GroupLeftOut {
  std::string group;
  std::size_t trials = 0;
  std::vector<double> accuracy;  ///< in the order of the learners
};

/// All input of the page, which reads no clock, file or machine data itself.
struct EvaluationPage {
  BenchKind bench = BenchKind::unknown;
  std::string dataset;
  std::vector<std::pair<std::string, std::string>> facts;  ///< name and value, plain text
  double feature_s_per_sample = 0.0;                       ///< 0: not measured
  const std::vector<EvaluatedLearner>& learners;
  const std::vector<GroupLeftOut>& groups;  ///< may be empty
  const std::vector<CurvePoint>& curve;     ///< may be empty
};

/// Every picture and table shows the kind of bench.
Document evaluation_document(const EvaluationPage& page);

/// Reliability table as plain text, heading first: bin ("0.9 to 1.0"), answers, recordings, mean
/// predicted, observed, 95 % interval.
std::vector<std::vector<std::string>> reliability_rows(const classifier::CalibrationCheck& check);

/// The methods of these intervals, each named once.
std::string bin_methods(const classifier::CalibrationCheck& check);

/// "63.20, 55.10 to 70.20": accuracy and interval in per cent; "-" without scores.
std::string format_level_removed(const std::optional<classifier::Scores>& scores);

/// "0.041 (0.032 to 0.060), Brier 0.12": the calibration error with its interval.
std::string format_calibration(const classifier::CalibrationCheck& check);

}  // namespace weft::daemon
