#pragma once
// Cost of testing the candidates of a choice, by a formula of their shapes. No clock is read, so
// every machine makes the same choice.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "classifier/learners/learner.hpp"

namespace weft::classifier {

/// Shape of a cross-validation.
struct TrainingShape {
  std::size_t rows = 0;
  std::size_t columns = 0;  ///< of the whole matrix; a recipe may take fewer
  std::size_t classes = 0;
  std::size_t trainings = 0;  ///< folds of all rounds
};

/// Seconds that the cross-validation of a recipe takes on the reference machine (two cores of an
/// EPYC as in classifier/MEASURED.md) if no fold is skipped. On the data sets there it is mostly
/// right to a factor of three, for p-value cores to a factor of ten either way: the separation of
/// the classes counts too. It rises with every number of the shape.
double training_cost(const Recipe& recipe, const TrainingShape& shape, const TrainOptions& options);

/// Selects the candidates that a choice tests: in their order, while the sum of their costs is
/// within options.budget. A candidate that exceeds it is skipped and costs nothing; a later one may
/// still fit. If already the first one does not fit, none is tested. One score per candidate, with
/// recipe and cost; errors are not counted yet.
std::vector<RecipeScore> within_budget(std::span<const Recipe> candidates,
                                       const TrainingShape& shape, const TrainOptions& options);

/// "not tried: svc, WIDE, estimated 80 s (--time-budget allows 60 s in total)"; empty if nothing
/// was skipped.
std::string format_skipped(std::span<const RecipeScore> scores);

}  // namespace weft::classifier
