#pragma once
// Training rows that are left out as outliers: section 2.2 of the paper of 2023.

#include <cstddef>
#include <map>
#include <string>

#include "classifier/features/feature_matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Takes out the rows that have a value further from the mean of its column than `deviations`
/// standard deviations, both over all rows given; once, not again over what remains (S10 in
/// docs/reference/machine-learning.md). Returns how many of each label, 0 of most; of `deviations`
/// 0 nothing, and every row stays. Errors: range, naming the label, where one would have no row
/// left; `rows` is then as it was. Pure but for `rows`, which needs one row.
Result<std::map<std::string, std::size_t>> remove_outliers(FeatureMatrix& rows, double deviations);

}  // namespace weft::classifier
