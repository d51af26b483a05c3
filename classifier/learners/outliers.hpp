#pragma once
// Removal of outliers from the training rows: section 2.2 of the paper of 2023.

#include <cstddef>
#include <map>
#include <string>

#include "classifier/features/feature_matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Removes the rows with a value further from the mean of its column than `deviations` standard
/// deviations. Both are over all given rows. It is applied once, not again to the remainder (S10 in
/// docs/reference/machine-learning.md). Returns the number removed per label, including 0. With
/// `deviations` 0 it returns nothing and keeps every row. Errors: range, naming the label, if a
/// label would lose all rows; `rows` does not change then. Changes only `rows`, which needs one
/// row.
Result<std::map<std::string, std::size_t>> remove_outliers(FeatureMatrix& rows, double deviations);

}  // namespace weft::classifier
