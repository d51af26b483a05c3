#pragma once
// Whether probabilities mean what they say: of the trials called with 80 %, are 80 % right?

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

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

}  // namespace weft::classifier
