#pragma once
// Calibration of the probabilities of a trained learner, on trials outside its training.

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

// Calibration: of the trials with a stated probability of 80 %, are 80 % right?

/// Trials with a predicted probability in [low, high); the last bin includes 1.
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

/// Index of the bin that contains `stated` (0 to 1), among `bins` bins of equal width.
std::size_t reliability_bin(double stated, std::size_t bins);

/// `probability` [trials x classes], each in [0, 1]; `answer` and `truth` are columns of it.
/// Refuses sizes that disagree, no trials, no bins, a column out of range, a value outside [0, 1].
Result<Reliability> reliability(const Matrix& probability, std::span<const std::size_t> answer,
                                std::span<const std::size_t> truth, std::size_t bins = 10);

/// Data on the answers in one bin, beside its ReliabilityBin.
struct BinCheck {
  std::size_t recordings = 0;  ///< number of different recordings, as in CalibrationCheck
  Interval observed_ci95;      ///< split_interval() of the splits' answers in the bin
};

/// Predictions of test trials with their probabilities, over all splits.
struct CalibrationCheck {
  Reliability reliability;
  std::vector<BinCheck> bins;  ///< one per entry of reliability.bins
  /// Number of different recordings among the test trials. Windows of one file (recording_of()) are
  /// one recording; a trial without a name is its own.
  std::size_t recordings = 0;
  /// Interval of reliability.calibration_error: percentiles over draws of whole recordings. With
  /// few trials chance alone makes the error larger than 0.
  Interval calibration_error_ci95;
};

/// Collects test answers, split after split.
class CalibrationTally {
 public:
  /// `labels`: all labels that any split trains, sorted.
  explicit CalibrationTally(std::vector<std::string> labels) : labels_(std::move(labels)) {}

  /// Fits the postprocessing of `learner` on the split's training part and predicts the test part.
  /// Adds nothing if the learner has no postprocessing, as it then states no probability.
  Status add(const FeatureMatrix& matrix, const Split& split, const TrainedLearner& learner,
             const TrainOptions& options);
  [[nodiscard]] bool empty() const { return answer_.empty(); }
  /// Errors if nothing was added before.
  [[nodiscard]] Result<CalibrationCheck> finish(std::size_t bins = 10) const;

 private:
  // Checks of each bin, from all splits.
  [[nodiscard]] std::vector<BinCheck> check_bins(std::span<const double> stated,
                                                 std::span<const double> right,
                                                 std::size_t bins) const;

  std::vector<std::string> labels_;
  std::vector<std::vector<double>> probability_;  // [answers x labels_]
  std::vector<std::size_t> answer_, truth_;
  std::vector<std::string> recording_;
  std::vector<std::size_t> split_;  // for each answer: index into sizes_
  std::vector<SplitSizes> sizes_;   // of the splits with answers
};

/// The 2.5 % and 97.5 % quantiles of the calibration error over 1000 draws of recordings with
/// replacement, with a fixed seed. `stated` and `right` (0 or 1) per answer; answers of one
/// `recording` are drawn together. Refuses no answers, no bins, sizes that disagree, a value
/// outside [0, 1].
Result<Interval> calibration_error_interval(std::span<const double> stated,
                                            std::span<const double> right,
                                            std::span<const std::string> recording,
                                            std::size_t bins);

}  // namespace weft::classifier
