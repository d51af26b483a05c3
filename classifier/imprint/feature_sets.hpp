#pragma once
// The feature sets that `best` chooses from for imprints: texture, the shape of the contact, or
// both.

#include <string>
#include <vector>

#include "classifier/features/feature_matrix.hpp"
#include "classifier/imprint/imprint_set.hpp"
#include "classifier/learners/learner.hpp"

namespace weft::classifier::imprint {

/// "10+laws5", "maps+10+laws5": the notation of the command line.
std::string to_string(const FeaturePlan& plan);

/// `plan` with the maps added after its features.
FeaturePlan with_maps(FeaturePlan plan);

/// The columns before those of the maps.
std::vector<std::size_t> columns_without_maps(const FeatureMatrix& matrix);

/// Candidates of `best` on a matrix of with_maps(plan). First all candidates for other data, on the
/// columns of `plan`; then LDA, SVC and trees on the maps, alone and with the other columns. An
/// array too small for maps has only the first group. `plan` has no maps.
std::vector<Recipe> feature_set_candidates(const FeatureMatrix& matrix, const FeaturePlan& plan,
                                           std::size_t cap);

/// The features of a recipe of feature_set_candidates(); `plan` for any other recipe.
FeaturePlan chosen_plan(const FeaturePlan& plan, const Recipe& recipe);

/// A learner in its stored form, with only the features that it uses.
struct UsedFeatures {
  TrainedLearner learner;
  FeatureMatrix matrix;
};
UsedFeatures used_features(const TrainedLearner& learner, const FeatureMatrix& matrix);

}  // namespace weft::classifier::imprint
