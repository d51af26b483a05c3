#pragma once
// The feature selection of a core: turns a feature vector into the inputs of its SVM.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "classifier/base/student_t.hpp"
#include "classifier/fabric/options.hpp"
#include "classifier/learn/feature_view.hpp"

namespace weft::classifier {

/// Directions in order of merit: ranked features, principal components, or all features. Every
/// member of the delta grid (or the explained-variance grid) uses the first few of them. So members
/// with the same number of directions are the same problem, and distances grow from one member to
/// the next.
class Reducer {
 public:
  /// Fits to training rows only; `sign` as in FoldMaker. Each sign must occur.
  static Reducer fit(const Matrix& rows, std::span<const int> sign, const TrainOptions& options,
                     const RareT& rare = RareT());
  /// Fits to the rows `which`; `sign` has one entry per row of the matrix.
  static Reducer fit(const Matrix& rows, std::span<const std::size_t> which,
                     std::span<const int> sign, const TrainOptions& options, const RareT& rare);

  /// Rebuilds a stored reducer; `axes` is empty unless the directions are components.
  Reducer(std::vector<std::size_t> columns, Scaler scaler, Matrix axes);

  /// Number of directions each grid member uses; for Reduction::all a single member.
  [[nodiscard]] const std::vector<std::size_t>& sizes() const { return sizes_; }
  [[nodiscard]] std::size_t directions() const {
    return axes_.rows() > 0 ? axes_.rows() : columns_.size();
  }
  /// Feature columns read, in ranked order; for components: all columns.
  [[nodiscard]] const std::vector<std::size_t>& columns() const { return columns_; }
  [[nodiscard]] const Scaler& scaler() const { return scaler_; }
  [[nodiscard]] const Matrix& axes() const { return axes_; }

  /// t of the columns() that it was fitted with; empty unless Reduction::pvalue.
  [[nodiscard]] const std::vector<double>& t() const { return t_; }
  /// Degrees of freedom of each t().
  [[nodiscard]] const std::vector<double>& df() const { return df_; }

  /// [rows x directions]
  [[nodiscard]] Matrix project(const Matrix& rows) const;
  /// Projects the rows `first`, then the rows `second`, to `out` [(first + second) x directions].
  void project(const Matrix& rows, std::span<const std::size_t> first,
               std::span<const std::size_t> second, Matrix& out) const;
  /// Projects one full feature vector to `out` [directions].
  void project(std::span<const double> features, std::span<double> out) const;
  /// The same reducer with only the first `directions`.
  [[nodiscard]] Reducer truncated(std::size_t directions) const;

 private:
  std::vector<std::size_t> columns_;
  Scaler scaler_;  // one entry per columns_
  Matrix axes_;    // [components x columns_], or empty
  std::vector<std::size_t> sizes_;
  std::vector<double> t_, df_;
};

}  // namespace weft::classifier
