#pragma once
// Scaling to zero mean and unit deviation, and the views of the features for a learner: plain,
// compressed, ranked among training values (as a share or as a normal score), standardised, or
// principal components.

#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

// Zero mean and unit deviation, fitted to training rows only (AMB-12).

/// value -> (value - mean) / deviation, per column.
struct Scaler {
  std::vector<double> mean;
  /// Biased deviation. It is 1 below the least normal double, and for a column that is constant up
  /// to rounding. It is at least 1e-9 of the largest value: the rounding of 1e22 must not count.
  std::vector<double> deviation;

  [[nodiscard]] double apply(std::size_t column, double value) const {
    return (value - mean[column]) / deviation[column];
  }
};

/// A spread that is a smaller share of the largest value is rounding and has no information.
inline constexpr double rounding_spread = 1e-12;

/// Needs at least one row. check_feature() must accept the values, so that no difference overflows.
Scaler fit_scaler(const Matrix& rows);

/// [rows x cols], scaled.
Matrix scaled(const Scaler& scaler, const Matrix& rows);

enum class View {
  plain,
  /// Scaled by all training rows, then sign(z) log(1 + |z|): moments of contact signals have long
  /// tails.
  compressed,
  /// The share of training values below, 0 to 1. It has no tails: the distance of two values is the
  /// number of training trials between them.
  ranked,
  /// Normal scores of the ranks (van der Waerden): the normal quantile of that share. There is no
  /// long tail, but rare values remain far out, as LDA assumes.
  normal_scores,
  standardised,  ///< zero mean, unit deviation of the training rows
  components     ///< principal components of the standardised features
};

std::string_view to_string(View view);
Result<View> view_from(std::string_view text);
/// Views that a choice tries: feature by feature and without a parameter; simple ones first.
std::vector<View> tried_views();

/// Ranks of values among those of a training, feature by feature.
class RankTable {
 public:
  /// Largest number of quantiles kept per feature; with fewer rows all values are kept.
  static constexpr std::size_t most_knots = 256;

  /// Needs at least one row; all values finite.
  static RankTable fit(const Matrix& rows);
  /// Rebuilds a stored table: [knots x features], at least one knot, columns not decreasing.
  explicit RankTable(Matrix knots) : knots_(std::move(knots)) {}

  /// Position of `value` among the knots: from 0 to their number - 1, never falling. It is linear
  /// between knots, and the middle of equal ones. For a feature that was constant (up to rounding)
  /// in the training it is the middle of all. `value` must be finite.
  [[nodiscard]] double position(std::size_t feature, double value) const;
  /// The position as a share between 0 and 1.
  [[nodiscard]] double place(std::size_t feature, double value) const;
  [[nodiscard]] const Matrix& knots() const { return knots_; }

 private:
  Matrix knots_;
};

/// Normal scores of ranks (van der Waerden 1952), linear between those of the knots.
class NormalScores {
 public:
  explicit NormalScores(RankTable ranks);

  /// Score of a finite `value`, never falling. It lies between the scores of the first and the last
  /// knot, which are opposite numbers; 0 for a feature that was constant in the training.
  [[nodiscard]] double score(std::size_t feature, double value) const;
  [[nodiscard]] const RankTable& ranks() const { return ranks_; }

 private:
  RankTable ranks_;
  std::vector<double> of_knot_;
};

struct Standardised {
  Scaler scaler;
};

/// Principal components of standardised features.
struct PrincipalComponents {
  Scaler scaler;
  Matrix axes;             ///< [components x features]
  double explained = 1.0;  ///< share of the variance of the training rows
};

/// A view with its fitted table. Immutable; may be used by several threads.
class FeatureView {
 public:
  /// In the order of View.
  using Table = std::variant<std::monostate, Scaler, RankTable, NormalScores, Standardised,
                             PrincipalComponents>;

  FeatureView() = default;  ///< plain
  explicit FeatureView(Table table) : table_(std::move(table)) {}
  /// Needs at least one row, all values finite. `components`: upper limit for View::components; the
  /// number of features limits it too.
  static FeatureView fit(View view, const Matrix& rows, std::size_t components = 0);

  [[nodiscard]] View kind() const { return static_cast<View>(table_.index()); }
  [[nodiscard]] const Table& table() const { return table_; }

  /// Transforms the features of one trial: as many as in the training, all finite.
  [[nodiscard]] std::vector<double> apply(std::span<const double> features) const;
  /// Transforms every row.
  [[nodiscard]] Matrix apply(Matrix rows) const;
  /// Names of the columns that apply() returns; the names of the features except for
  /// View::components.
  [[nodiscard]] std::vector<std::string> apply(const std::vector<std::string>& names) const;
  /// Number of columns that apply() returns for `features` features.
  [[nodiscard]] std::size_t width(std::size_t features) const;

 private:
  void apply_to_each(std::span<double> features) const;

  Table table_;
};

}  // namespace weft::classifier
