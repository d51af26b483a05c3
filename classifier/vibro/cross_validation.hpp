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

/// Principal components that the paper takes.
inline constexpr std::size_t papers_components = 3;

/// A learner as the paper of 2023 trains it: on scaled features, or their principal components.
Recipe window_recipe(Learner learner, std::size_t components = 0);
/// The paper's ten, then shrinkage LDA and cores on all features.
std::vector<Learner> window_learners();
/// The same on those of the columns of Family::wide that a family has.
Recipe window_recipe(Learner learner, std::size_t components, const std::vector<Channel>& channels,
                     FeatureChoice features);

/// What `best` tries on windows: learners that are quick to train, simple ones first.
std::vector<Recipe> window_candidates(std::size_t components = 0);
/// The same on each of four sets of features (SMMRPFFT, ALL, BANDS, WIDE), of rows of Family::wide.
std::vector<Recipe> window_candidates(const std::vector<Channel>& channels, Combine combine,
                                      std::size_t components = 0);

/// What came out over all splits.
struct CrossValidation {
  Confusion confusion;    ///< of windows, summed over the splits
  double accuracy = 0.0;  ///< of windows, mean over the splits
  double f_score = 0.0;   ///< macro, mean over the splits
  std::vector<double> split_accuracy{}, split_f_score{};
  /// Of test recordings (parts of one, with blocks) by the most frequent answer of their windows,
  /// the lowest of several.
  double voted_accuracy = 0.0;
  std::size_t voted = 0;          ///< different ones of them
  std::size_t voted_answers = 0;  ///< over all splits: each is asked in every split that tests it
  /// Over the splits, split_interval(); 0 to 1 with one alone, whose windows are not independent.
  Interval accuracy_ci95{}, f_score_ci95{};
  Interval voted_ci95{};       ///< of `voted_accuracy`: split_interval() of the splits' answers
  std::size_t components = 0;  ///< that were taken, the most of any split; 0: none
  double explained = 1.0;      ///< by the components, mean over the splits
  /// Of each label, training windows left out as outliers, over all splits; empty: none looked for.
  std::map<std::string, std::size_t> outliers{};
  double train_s = 0.0;          ///< mean over the splits
  double answer_s = 0.0;         ///< one row at a time, scaling and components included: the median
  std::vector<Recipe> chosen{};  ///< per split, where it was a choice
  std::vector<std::vector<RecipeScore>> candidates{};  ///< the same: what became of each
};

/// Macro F-score: the mean of 2 TP / (2 TP + FP + FN) over the labels that were asked about or
/// answered, as scikit-learn takes it; 0 without any.
double f_score(const Confusion& confusion);

/// Folds keep whole groups together under Protocol::groups.
TrainOptions window_training(TrainOptions options, Protocol protocol);

/// evaluate() of windows; of several candidates the best is chosen on the training windows of each
/// split (train_best()). Times are 0 without a clock.
Result<CrossValidation> cross_validate(const WindowSet& windows, std::span<const Split> splits,
                                       std::span<const Recipe> candidates,
                                       const TrainOptions& options,
                                       const SecondsNow& seconds_now = {});

}  // namespace weft::classifier::vibro
