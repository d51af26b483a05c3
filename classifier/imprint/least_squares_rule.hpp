#pragma once
// The multi-class minimum squared error rule, which Ellis 1986 (sections 3.4.5 and 4) names as the
// next thing to try.

#include "classifier/imprint/linear_rule.hpp"

namespace weft::classifier::imprint {

/// Weights whose products with the rows, a one for the bias appended, are nearest to 1 for a row's
/// own class and 0 for the others in the sum of squares (Duda and Hart, section 5.12); the shortest
/// of them where rows are fewer than features. Refuses what check_training() refuses.
Result<LinearRule> train_least_squares(const Matrix& rows, std::span<const std::size_t> of_row,
                                       std::size_t classes, FeatureScaling scaling);

}  // namespace weft::classifier::imprint
