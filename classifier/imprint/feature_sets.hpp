#pragma once
// The feature sets that `best` chooses from on imprints: texture, the shape of the contact, both.

#include <string>
#include <vector>

#include "classifier/features/feature_matrix.hpp"
#include "classifier/imprint/imprint_set.hpp"
#include "classifier/learners/learner.hpp"

namespace weft::classifier::imprint {

/// "10+laws5", "maps+10+laws5": as the command line names it.
std::string to_string(const FeaturePlan& plan);

/// The features of `plan` and those of the maps, in the columns behind them.
FeaturePlan with_maps(FeaturePlan plan);

/// The columns that are no maps, which are the first.
std::vector<std::size_t> columns_without_maps(const FeatureMatrix& matrix);

/// What `best` tries on a matrix of with_maps(plan): all that it tries on other data, on the
/// columns of `plan`; then LDA, SVC and trees on the maps, alone and beside them. An array too
/// small for maps has the first only. `plan` has no maps.
std::vector<Recipe> feature_set_candidates(const FeatureMatrix& matrix, const FeaturePlan& plan,
                                           std::size_t cap);

/// The features of a recipe of feature_set_candidates(), `plan` where that is none of them.
FeaturePlan chosen_plan(const FeaturePlan& plan, const Recipe& recipe);

/// A learner as it is stored, with the features that it takes: none that it does not use.
struct UsedFeatures {
  TrainedLearner learner;
  FeatureMatrix matrix;
};
UsedFeatures used_features(const TrainedLearner& learner, const FeatureMatrix& matrix);

}  // namespace weft::classifier::imprint
