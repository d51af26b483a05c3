#pragma once
// Trains and tests learners on splits of windows.

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "classifier/base/interval.hpp"
#include "classifier/evaluate/evaluate.hpp"
#include "classifier/evaluate/splits.hpp"
#include "classifier/learners/learner.hpp"
#include "classifier/vibro/protocol.hpp"

namespace weft::classifier::vibro {

/// Number of principal components in the paper.
inline constexpr std::size_t papers_components = 3;

/// A learner trained as in the paper of 2023: on scaled features, or their principal components.
Recipe window_recipe(Learner learner, std::size_t components = 0);
/// The paper's ten, then shrinkage LDA and cores on all features.
std::vector<Learner> window_learners();
/// The same on the columns of Family::wide that the family of `features` has.
Recipe window_recipe(Learner learner, std::size_t components, const std::vector<Channel>& channels,
                     FeatureChoice features);

/// Candidates of `best` on windows: learners that train quickly, simple ones first.
std::vector<Recipe> window_candidates(std::size_t components = 0);
/// The same on each of four sets of features (SMMRPFFT, ALL, BANDS, WIDE), for rows of
/// Family::wide.
std::vector<Recipe> window_candidates(const std::vector<Channel>& channels, Combine combine,
                                      std::size_t components = 0);

/// Results over all splits.
struct CrossValidation {
  Confusion confusion;    ///< of windows, summed over the splits
  double accuracy = 0.0;  ///< of windows, mean over the splits
  double f_score = 0.0;   ///< macro, mean over the splits
  std::vector<double> split_accuracy{}, split_f_score{};
  /// Accuracy per test recording (with blocks, per part of one), by majority vote of its windows;
  /// the lowest label wins a tie.
  double voted_accuracy = 0.0;
  std::size_t voted = 0;  ///< number of distinct test recordings (or parts)
  std::size_t voted_answers =
      0;  ///< over all splits: a recording counts in every split that tests it
  /// split_interval() over the splits. With a single split it is 0 to 1, because its windows are
  /// not independent.
  Interval accuracy_ci95{}, f_score_ci95{};
  Interval voted_ci95{};       ///< of `voted_accuracy`: split_interval() of the splits' answers
  std::size_t components = 0;  ///< number used, the largest of any split; 0: none
  double explained =
      1.0;  ///< share of the variance explained by the components, mean over the splits
  /// Per label: training windows left out as outliers, over all splits; empty: none were searched.
  std::map<std::string, std::size_t> outliers{};
  double train_s = 0.0;  ///< mean over the splits
  double answer_s =
      0.0;  ///< seconds for one row at a time, scaling and components included: the median
  std::vector<Recipe> chosen{};  ///< per split, if there was a choice
  std::vector<std::vector<RecipeScore>>
      candidates{};  ///< per split, if there was a choice: the result of each candidate
};

/// Macro F-score: the mean of 2 TP / (2 TP + FP + FN) over the labels that were tested or
/// predicted, as in scikit-learn; 0 without any.
double f_score(const Confusion& confusion);

/// Folds keep whole groups together under Protocol::groups.
TrainOptions window_training(TrainOptions options, Protocol protocol);

/// evaluate() of windows. With several candidates each split chooses the best on its training
/// windows (train_best()). Times are 0 without a clock.
Result<CrossValidation> cross_validate(const WindowSet& windows, std::span<const Split> splits,
                                       std::span<const Recipe> candidates,
                                       const TrainOptions& options,
                                       const SecondsNow& seconds_now = {});

}  // namespace weft::classifier::vibro
