#pragma once
// What it costs to test the candidates of a choice, by a formula of their shapes: no clock is read,
// so every machine comes to the same choice.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "classifier/learners/learner.hpp"

namespace weft::classifier {

/// Of a cross-validation.
struct TrainingShape {
  std::size_t rows = 0;
  std::size_t columns = 0;  ///< of the whole matrix; a recipe may take fewer
  std::size_t classes = 0;
  std::size_t trainings = 0;  ///< folds of all rounds
};

/// Seconds that the cross-validation of a recipe takes on the reference machine, two cores of an
/// EPYC as in classifier/MEASURED.md, where none of its folds is spared. On the sets there mostly
/// right to a factor of three, of p-value cores to one of ten either way: how well the features
/// part the classes counts too. Rises with every number of the shape.
double training_cost(const Recipe& recipe, const TrainingShape& shape, const TrainOptions& options);

/// Which candidates a choice tests: in their order as long as the sum of their costs is within
/// options.budget. One that exceeds it is skipped and costs nothing; one that comes after may still
/// fit. Where already the first does not fit, none is tested. One score per candidate, with recipe
/// and cost; errors are not counted yet.
std::vector<RecipeScore> within_budget(std::span<const Recipe> candidates,
                                       const TrainingShape& shape, const TrainOptions& options);

/// "not tried: svc, WIDE, estimated 80 s (--time-budget allows 60 s in all)"; empty where nothing
/// was skipped.
std::string format_skipped(std::span<const RecipeScore> scores);

}  // namespace weft::classifier
