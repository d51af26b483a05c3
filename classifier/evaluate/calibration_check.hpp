#pragma once
// Whether the probabilities of a trained learner mean what they say, on trials it never saw.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "classifier/base/interval.hpp"
#include "classifier/base/matrix.hpp"
#include "classifier/evaluate/splits.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/learners/learner.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

// Whether probabilities mean what they say: of the trials called with 80 %, are 80 % right?

/// Trials whose answer got a probability in [low, high); the last bin includes 1.
struct ReliabilityBin {
  double low = 0.0;
  double high = 0.0;
  std::size_t count = 0;
  double predicted = 0.0;  ///< mean probability of the answers; 0 where count is 0
  double observed = 0.0;   ///< share of right answers; 0 where count is 0
};

struct Reliability {
  std::vector<ReliabilityBin> bins;  ///< equal widths
  /// Expected calibration error: mean over the trials of |predicted - observed| of their bin.
  double calibration_error = 0.0;
  double brier =
      0.0;  ///< mean over the trials of sum over classes (p - 1 of the true class)^2; 0 to 2
  double log_loss = 0.0;  ///< mean of -ln p(true class), p at least 1e-12
  std::size_t trials = 0;
};

/// Of `bins` equal widths the one that holds `stated`, 0 to 1.
std::size_t reliability_bin(double stated, std::size_t bins);

/// `probability` [trials x classes], each in [0, 1]; `answer` and `truth` are columns of it.
/// Refuses sizes that disagree, no trials, no bins, a column beyond the last, a value outside [0,
/// 1].
Result<Reliability> reliability(const Matrix& probability, std::span<const std::size_t> answer,
                                std::span<const std::size_t> truth, std::size_t bins = 10);

/// What is known of the answers in one bin, beside its ReliabilityBin.
struct BinCheck {
  std::size_t recordings = 0;  ///< different ones among them, as in CalibrationCheck
  Interval observed_ci95;      ///< split_interval() of the splits' answers in the bin
};

/// Answers on test trials with the probability that each was given, over all splits.
struct CalibrationCheck {
  Reliability reliability;
  std::vector<BinCheck> bins;  ///< of reliability.bins
  /// Different ones among the test trials: files, windows of one file (recording_of()) together; a
  /// trial without a name is its own.
  std::size_t recordings = 0;
  /// Of reliability.calibration_error: percentiles of draws of whole recordings. Chance alone makes
  /// the error of few trials larger than 0.
  Interval calibration_error_ci95;
};

/// Collects test answers, split after split.
class CalibrationTally {
 public:
  /// `labels`: all that any split trains, sorted.
  explicit CalibrationTally(std::vector<std::string> labels) : labels_(std::move(labels)) {}

  /// Learns the aids of `learner` from the split's training part and asks it for the test part.
  /// Nothing is added where there are none: such a learner says no probability.
  Status add(const FeatureMatrix& matrix, const Split& split, const TrainedLearner& learner,
             const TrainOptions& options);
  [[nodiscard]] bool empty() const { return answer_.empty(); }
  /// Refuses to finish before anything was added.
  [[nodiscard]] Result<CalibrationCheck> finish(std::size_t bins = 10) const;

 private:
  // What the splits say of each bin.
  [[nodiscard]] std::vector<BinCheck> check_bins(std::span<const double> stated,
                                                 std::span<const double> right,
                                                 std::size_t bins) const;

  std::vector<std::string> labels_;
  std::vector<std::vector<double>> probability_;  // [answers x labels_]
  std::vector<std::size_t> answer_, truth_;
  std::vector<std::string> recording_;
  std::vector<std::size_t> split_;  // of each answer: which of the sizes
  std::vector<SplitSizes> sizes_;   // of the splits that gave answers
};

/// Error of each draw of recordings: 2.5 % and 97.5 % of 1000 draws with replacement, fixed seed.
/// `stated` and `right` (0 or 1) per answer; answers of one `recording` are drawn together. Refuses
/// no answers, no bins, sizes that disagree, a value outside [0, 1].
Result<Interval> calibration_error_interval(std::span<const double> stated,
                                            std::span<const double> right,
                                            std::span<const std::string> recording,
                                            std::size_t bins);

}  // namespace weft::classifier
