#pragma once
// Kesler's construction of the multi-class perceptron (Ellis 1986, section 3.2, after Duda and
// Hart): the paper's learning rule.

#include "classifier/imprint/linear_rule.hpp"

namespace weft::classifier::imprint {

struct KeslerOptions {
  FeatureScaling scaling = FeatureScaling::none;
  double c = 1.0;                  ///< learning constant, above 0
  std::size_t most_rounds = 1000;  ///< then convergence has failed, says the paper
};

struct KeslerOutcome {
  LinearRule rule;  ///< where it did not converge: as the last round left it
  bool converged = false;
  std::size_t rounds = 0;    ///< over the data, the clean one included
  std::size_t mistakes = 0;  ///< in the last round; 0 means converged
};

/// Weights start at zero; rows come in their order, again and again; a row of class i that is taken
/// for class j adds c times itself, and c for the bias, to i and takes it from j (choice E6). Equal
/// products go to the lowest class. Stops after the first round without a mistake. Refuses what
/// check_training() refuses, c that is not finite and above 0, no round.
Result<KeslerOutcome> train_kesler(const Matrix& rows, std::span<const std::size_t> of_row,
                                   std::size_t classes, const KeslerOptions& options);

}  // namespace weft::classifier::imprint
