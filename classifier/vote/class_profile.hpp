#pragma once
// Where every class lies in feature space: what a short-list and the reject rule measure distances
// from.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Class means of the training rows, and the deviation of every feature about them.
struct ClassProfile {
  Matrix mean;                    ///< [classes x features], in the features' own units
  std::vector<double> deviation;  ///< per feature, about its row's class mean, pooled; positive

  [[nodiscard]] std::size_t classes() const { return mean.rows(); }
  [[nodiscard]] bool empty() const { return mean.rows() == 0; }
};

/// `labels` are those of the model, sorted; every one needs a row, and rows of other labels are
/// refused. A feature that never varies within a class is scaled by its deviation over all rows, or
/// by 1.
Result<ClassProfile> fit_profile(const FeatureMatrix& matrix, std::span<const std::string> labels);

/// Mean over the features of |difference| / deviation, from `features` to every row of `points`. A
/// sum that overflows is infinite, never NaN. As many finite features as `points` has columns.
std::vector<double> scaled_distances(const Matrix& points, std::span<const double> deviation,
                                     std::span<const double> features);

/// The `count` nearest classes (all, when there are no more), ascending by class; equal distances
/// go to the lower class.
std::vector<std::size_t> nearest_classes(const ClassProfile& profile,
                                         std::span<const double> features, std::size_t count);

/// Position of every row's label in `labels` (sorted). Refuses a label that is not there.
Result<std::vector<std::size_t>> class_numbers(const FeatureMatrix& matrix,
                                               std::span<const std::string> labels);

}  // namespace weft::classifier
