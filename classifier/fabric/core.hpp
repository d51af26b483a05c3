#pragma once
// One fabric classification core: separates fabric a (f > 0) from fabric b. Section III-A of Khan
// et al. 2016.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "classifier/fabric/grid_search.hpp"
#include "classifier/fabric/options.hpp"
#include "classifier/fabric/reducer.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// f(x) = sum_s coefficient[s] exp(-gamma |project(x) - support[s]|^2) + bias. Immutable.
class PackedCore {
 public:
  /// `support` [support vectors x directions], already projected by `reducer`.
  PackedCore(const Reducer& reducer, const Matrix& support, std::span<const double> coefficient,
             double gamma, double bias);

  /// Decision value of one full feature vector. No allocation up to `most_on_stack` columns,
  /// directions and support vectors together.
  [[nodiscard]] double decide(std::span<const double> features) const;

  static constexpr std::size_t most_on_stack = 1024;

 private:
  friend struct PackedView;
  std::vector<std::uint32_t> columns_;
  std::size_t directions_ = 0, vectors_ = 0;
  std::size_t axes_width_ = 0;     // directions rounded up to whole blocks; 0 without axes
  std::size_t support_width_ = 0;  // vectors rounded up to whole blocks
  double gamma_ = 0.0, bias_ = 0.0;
  /// mean and deviation of the columns, axes [columns x width], support [directions x width],
  /// coefficients
  std::vector<double> data_;
};

/// A feature that a core uses, with the result of the t-test on its training rows.
struct SelectedFeature {
  std::size_t column = 0;
  double t = 0.0;
  double p_value = 1.0;  ///< 0 when it underflows; then see log_p
  double log_p = 0.0;    ///< natural logarithm
};

/// How a core was trained.
struct CoreInfo {
  std::vector<SelectedFeature> selected;  ///< best first; empty unless Reduction::pvalue
  std::size_t inputs = 0;                 ///< features or components that enter the SVM
  double threshold = 0.0;  ///< chosen delta, or share of the variance; 0 with all features
  double c = 0.0;
  double gamma = 0.0;
  std::size_t cv_errors = 0;  ///< errors of the chosen grid point among train_rows
  double cv_loss = 0.0;
  std::size_t train_rows = 0;
  std::size_t folds =
      0;  ///< folds of the cross-validation; with two trials a class it leaves one out
  std::size_t fits = 0;  ///< number of SVMs solved for the grid
};

/// A trained core. Immutable; may be used by several threads.
class FabricCore {
 public:
  /// `support` [support vectors x inputs], already projected by `reducer`.
  FabricCore(CoreInfo info, Reducer reducer, Matrix support, std::vector<double> coefficient,
             double bias);

  /// Decision value of one full feature vector: f > 0 is a vote for a.
  [[nodiscard]] double decide(std::span<const double> features) const {
    return packed_.decide(features);
  }

  [[nodiscard]] const CoreInfo& info() const { return info_; }
  [[nodiscard]] const Reducer& reducer() const { return reducer_; }
  [[nodiscard]] const Matrix& support() const { return support_; }
  [[nodiscard]] const std::vector<double>& coefficient() const { return coefficient_; }
  [[nodiscard]] double bias() const { return bias_; }

 private:
  CoreInfo info_;
  Reducer reducer_;
  Matrix support_;
  std::vector<double> coefficient_;  // alpha y per support vector
  double bias_;
  PackedCore packed_;
};

/// Searches the grid, then trains one SVM on all rows. `sign`: +1 for class a, -1 for class b; each
/// occurs at least twice. `search` keeps its memory from core to core. Errors: those of
/// GridSearch::run().
Result<FabricCore> train_core(const Matrix& rows, std::span<const int> sign,
                              std::span<const Fold> folds, const TrainOptions& options,
                              const RareT& rare, GridSearch& search);

}  // namespace weft::classifier
