#pragma once
// Where every class lies in feature space, and "none of these": how strange a trial is, measured
// against training trials that were left out.

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

// Where every class lies in feature space: what a short-list and the reject rule measure distances
// from.

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

/// What a trial is refused for. A larger score is stranger in each.
enum class RejectKind {
  /// Distance to the nearest training trial over that trial's own distance to the nearest of its
  /// fabric (a local outlier ratio): fabrics may have several clusters, of different widths.
  neighbour,
  class_mean,  ///< distance to the winner's mean over that of the winner's own trials left out
  probability  ///< 1 - probability of the winner; 0 where there is none (VoteKind::dag)
};
inline constexpr std::size_t reject_kinds = 3;
std::string_view to_string(RejectKind kind);
Result<RejectKind> reject_kind_from(std::string_view text);

/// One number per RejectKind.
using Novelty = std::array<double, reject_kinds>;

struct RejectRule {
  RejectKind kind = RejectKind::neighbour;
  double false_reject = 0.05;  ///< share of known trials that may be refused, as asked for
  Novelty threshold{};         ///< a trial is refused above it
  Matrix trial;                ///< [training trials x features]
  std::vector<double> radius;  ///< per training trial: to the nearest of its class; positive
  std::vector<double> spread;  ///< per class: mean distance of its trials to their mean; positive

  [[nodiscard]] bool refuses(const Novelty& novelty) const {
    const auto k = static_cast<std::size_t>(kind);
    return !(novelty[k] <= threshold[k]);
  }
};

/// Distances are scaled_distances(). `own` and `unit` per training row: its class; rows of one unit
/// (windows of one recording) never stand in for each other. Radii and spreads only; thresholds
/// come from training_novelty(). Where a class has a single unit, or only duplicates, its mean
/// radius (that of all classes, 1) stands in.
RejectRule fit_reject(const FeatureMatrix& matrix, const ClassProfile& profile,
                      std::span<const std::size_t> own, std::span<const std::size_t> unit,
                      std::size_t threads = 0);

/// Scores of a trial; never NaN. `probability` of the winner.
Novelty novelty(const RejectRule& rule, const ClassProfile& profile,
                std::span<const double> features, std::size_t winner, double probability);

/// Scores of training row `row` as if its unit had never been recorded; the deviations of the
/// profile alone have seen it. `winner` and `probability` from held-out decisions.
Novelty training_novelty(const RejectRule& rule, const ClassProfile& profile,
                         std::span<const std::size_t> own, std::span<const std::size_t> unit,
                         std::size_t row, std::size_t winner, double probability);

/// The threshold that at most `share` of further trials of the same kind exceed: the
/// ceil((n + 1)(1 - share))-th smallest of the n scores (the conformal quantile), or the largest.
double upper_threshold(std::vector<double> scores, double share);

}  // namespace weft::classifier
