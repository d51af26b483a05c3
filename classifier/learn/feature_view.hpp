#pragma once
// Scaling to zero mean and unit deviation, and how a learner sees the features: as they are,
// compressed, by their rank among training values, as a share or as a normal score, scaled, or as
// principal components.

#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

// Zero mean, unit deviation, learnt from training rows only (AMB-12).

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

enum class View {
  plain,
  /// Scaled by all training rows, then sign(z) log(1 + |z|): moments of contact signals have long
  /// tails.
  compressed,
  /// The share of training values below, 0 to 1: no tail is left, and how far apart two values are
  /// counts by how many trials lie between them.
  ranked,
  /// The ranks as van der Waerden has them: where a normal distribution has that share below. No
  /// tail is left, and what is rare counts as far out: what LDA takes for granted.
  normal_scores,
  standardised,  ///< zero mean, unit deviation of the training rows
  components     ///< principal components of the standardised features
};

std::string_view to_string(View view);
Result<View> view_from(std::string_view text);
/// Those that a choice tries, feature by feature and without a number to set; simple ones first.
std::vector<View> tried_views();

/// Places of values among those of a training, feature by feature.
class RankTable {
 public:
  /// Quantiles kept of a feature; all values where rows are fewer.
  static constexpr std::size_t most_knots = 256;

  /// At least one row, all values finite.
  static RankTable fit(const Matrix& rows);
  /// A stored one: [knots x features], at least one knot, columns not falling.
  explicit RankTable(Matrix knots) : knots_(std::move(knots)) {}

  /// Between which knots `value` lies: from 0 to their number - 1, never falling; linear between
  /// knots, in the middle of equal ones, and of all for a feature that was constant (up to
  /// rounding) in the training. `value` finite.
  [[nodiscard]] double position(std::size_t feature, double value) const;
  /// The position as a share between 0 and 1.
  [[nodiscard]] double place(std::size_t feature, double value) const;
  [[nodiscard]] const Matrix& knots() const { return knots_; }

 private:
  Matrix knots_;
};

/// Normal scores of places (van der Waerden 1952), linear between those of the knots.
class NormalScores {
 public:
  explicit NormalScores(RankTable ranks);

  /// Never falling in `value`, which is finite; between the scores of the first knot and of the
  /// last, which lie opposite; 0 for a feature that was constant in the training.
  [[nodiscard]] double score(std::size_t feature, double value) const;
  [[nodiscard]] const RankTable& ranks() const { return ranks_; }

 private:
  RankTable ranks_;
  std::vector<double> of_knot_;
};

struct Standardised {
  Scaler scaler;
};

/// Of standardised features.
struct PrincipalComponents {
  Scaler scaler;
  Matrix axes;             ///< [components x features]
  double explained = 1.0;  ///< share of the variance of the training rows
};

/// A view and what it learnt. Immutable; may be used by several threads.
class FeatureView {
 public:
  /// In the order of View.
  using Table = std::variant<std::monostate, Scaler, RankTable, NormalScores, Standardised,
                             PrincipalComponents>;

  FeatureView() = default;  ///< plain
  explicit FeatureView(Table table) : table_(std::move(table)) {}
  /// At least one row, all values finite. `components`: the most of View::components, of fewer
  /// features as many as there are.
  static FeatureView fit(View view, const Matrix& rows, std::size_t components = 0);

  [[nodiscard]] View kind() const { return static_cast<View>(table_.index()); }
  [[nodiscard]] const Table& table() const { return table_; }

  /// Features of one trial. As many as the training had, all finite.
  [[nodiscard]] std::vector<double> apply(std::span<const double> features) const;
  /// Every row so.
  [[nodiscard]] Matrix apply(Matrix rows) const;
  /// Names of what apply() gives; those of the features but for View::components.
  [[nodiscard]] std::vector<std::string> apply(const std::vector<std::string>& names) const;
  /// Columns that apply() gives of so many features.
  [[nodiscard]] std::size_t width(std::size_t features) const;

 private:
  void apply_to_each(std::span<double> features) const;

  Table table_;
};

}  // namespace weft::classifier
