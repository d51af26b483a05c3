#pragma once
// Position of every class in feature space, and the open-set check: the novelty of a trial,
// compared with that of held-out training trials.

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

// Position of every class in feature space: the reference of distances for short-lists and the
// reject rule.

/// Class means of the training rows, and the deviation of every feature about them.
struct ClassProfile {
  Matrix mean;                    ///< [classes x features], in the features' own units
  std::vector<double> deviation;  ///< per feature, about its row's class mean, pooled; positive

  [[nodiscard]] std::size_t classes() const { return mean.rows(); }
  [[nodiscard]] bool empty() const { return mean.rows() == 0; }
};

/// `labels` are those of the model, sorted. Every label needs a row; rows of other labels are
/// refused. A feature that never varies within a class is scaled by its deviation over all rows, or
/// by 1.
Result<ClassProfile> fit_profile(const FeatureMatrix& matrix, std::span<const std::string> labels);

/// Mean over the features of |difference| / deviation, from `features` to every row of `points`. A
/// sum that overflows is infinite, never NaN. `features` needs as many finite values as `points`
/// has columns.
std::vector<double> scaled_distances(const Matrix& points, std::span<const double> deviation,
                                     std::span<const double> features);

/// The `count` nearest classes (all, if there are fewer), ascending by class; the lower class wins
/// a tie.
std::vector<std::size_t> nearest_classes(const ClassProfile& profile,
                                         std::span<const double> features, std::size_t count);

/// Index of every row's label in `labels` (sorted). Refuses a label that is not in the list.
Result<std::vector<std::size_t>> class_numbers(const FeatureMatrix& matrix,
                                               std::span<const std::string> labels);

/// Score that refuses a trial. A larger score means a more unusual trial.
enum class RejectKind {
  /// Distance to the nearest training trial, divided by that trial's own distance to the nearest of
  /// its fabric (a local outlier ratio). Fabrics may have several clusters of different widths.
  neighbour,
  class_mean,  ///< distance to the winner's mean, divided by that of the winner's held-out trials
  probability  ///< 1 - probability of the winner; 0 without one (VoteKind::dag)
};
inline constexpr std::size_t reject_kinds = 3;
std::string_view to_string(RejectKind kind);
Result<RejectKind> reject_kind_from(std::string_view text);

/// One number per RejectKind.
using Novelty = std::array<double, reject_kinds>;

struct RejectRule {
  RejectKind kind = RejectKind::neighbour;
  double false_reject = 0.05;  ///< requested share of known trials that may be refused
  Novelty threshold{};         ///< a trial is refused above it
  Matrix trial;                ///< [training trials x features]
  std::vector<double>
      radius;  ///< per training trial: distance to the nearest of its class; positive
  std::vector<double> spread;  ///< per class: mean distance of its trials to their mean; positive

  [[nodiscard]] bool refuses(const Novelty& novelty) const {
    const auto k = static_cast<std::size_t>(kind);
    return !(novelty[k] <= threshold[k]);
  }
};

/// Fits radii and spreads; thresholds come from training_novelty(). Distances are
/// scaled_distances(). `own`: the class of each training row. `unit`: rows of one unit (windows of
/// one recording) never count as neighbours of each other. If a class has a single unit, or only
/// duplicates, its mean radius is used (that of all classes, or 1).
RejectRule fit_reject(const FeatureMatrix& matrix, const ClassProfile& profile,
                      std::span<const std::size_t> own, std::span<const std::size_t> unit,
                      std::size_t threads = 0);

/// Scores of a trial; never NaN. `probability` is that of the winner.
Novelty novelty(const RejectRule& rule, const ClassProfile& profile,
                std::span<const double> features, std::size_t winner, double probability);

/// Scores of training row `row` as if its unit had never been recorded; only the profile's
/// deviations include it. `winner` and `probability` come from held-out decisions.
Novelty training_novelty(const RejectRule& rule, const ClassProfile& profile,
                         std::span<const std::size_t> own, std::span<const std::size_t> unit,
                         std::size_t row, std::size_t winner, double probability);

/// The threshold that at most `share` of further trials of the same kind exceed. It is the ceil((n
/// + 1)(1 - share))-th smallest of the n scores (the conformal quantile), or the largest.
double upper_threshold(std::vector<double> scores, double share);

}  // namespace weft::classifier
