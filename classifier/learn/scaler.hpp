#pragma once
// Zero mean, unit deviation, learnt from training rows only (AMB-12).

#include <vector>

#include "classifier/base/matrix.hpp"

namespace weft::classifier {

/// value -> (value - mean) / deviation, per column.
struct Scaler {
  std::vector<double> mean;
  /// Biased; 1 where it is below the least double, and for a column that is constant up to
  /// rounding, but at least 1e-9 of its largest value: the rounding of 1e22 must not count.
  std::vector<double> deviation;

  [[nodiscard]] double apply(std::size_t column, double value) const {
    return (value - mean[column]) / deviation[column];
  }
};

/// A spread that is a smaller share of the largest value is rounding, and says nothing.
inline constexpr double rounding_spread = 1e-12;

/// Needs at least one row; values as check_feature() has them, so that no difference overflows.
Scaler fit_scaler(const Matrix& rows);

/// [rows x cols], scaled.
Matrix scaled(const Scaler& scaler, const Matrix& rows);

}  // namespace weft::classifier
