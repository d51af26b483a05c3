#pragma once
// Pictures of an evaluation: what probabilities are worth, and what more training trials bring.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/evaluate/evaluate.hpp"

namespace weft::daemon {

/// Share of right answers against the probability they were given, with the intervals of the bins;
/// the diagonal is perfect. Bars below: how many answers.
std::string reliability_figure(const classifier::CalibrationCheck& check, std::string_view title);

/// One learner at one number of training trials.
struct CurveValue {
  std::string learner;
  double accuracy = 0.0;
  double deviation = 0.0;     ///< over the draws
  classifier::Interval ci95;  ///< over the splits, each with the mean of its draws
};
struct CurvePoint {
  std::size_t trials = 0;  ///< of each label, at most
  std::size_t draws = 0;   ///< over all splits
  std::vector<CurveValue> values;
};

/// Accuracy against training trials of each label; a line and a mark per learner, bars: deviation
/// over the draws. `curve` by rising number of trials, all with the same learners.
std::string learning_curve_figure(const std::vector<CurvePoint>& curve);

}  // namespace weft::daemon
