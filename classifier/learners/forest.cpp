#include <algorithm>
#include <numeric>

#include "classifier/learners/learners.hpp"
#include "classifier/learners/tree_ensemble.hpp"

namespace weft::classifier {
namespace {

// `rows` row numbers, drawn with replacement.
std::vector<std::uint32_t> drawn(std::size_t rows, RandomEngine& engine) {
  std::vector<std::uint32_t> out;
  for (std::size_t i = 0; i < rows; ++i)
    out.push_back(static_cast<std::uint32_t>(random_below(engine, rows)));
  return out;
}

struct Forest {
  std::vector<DecisionTree> trees;
  std::vector<double> importance;
};

Result<Forest> grow_forest(const TrainingSet& training, const TrainOptions& options) {
  if (options.trees == 0)
    return fail({.code = Errc::invalid_argument,
                 .where = "RForest",
                 .what = "too few trees",
                 .expected = "at least 1",
                 .got = "0"});
  const RankedRows rows(training.rows(), training.of_row(), training.classes());
  const SplitRule rule{features_of_a_split(rows.features())};
  Forest out;
  Matrix importance(options.trees, rows.features());
  auto trees = grow_trees(options.trees, options, [&](std::size_t t) {
    RandomEngine engine = engine_of_tree(options.seed, t);
    return DecisionTree::grow(rows, drawn(rows.rows(), engine), rule, engine, importance.row(t));
  });
  if (!trees) return pass(trees.error());
  out.trees = std::move(*trees);
  out.importance.assign(rows.features(), 0.0);
  for (std::size_t t = 0; t < options.trees; ++t)
    for (std::size_t f = 0; f < rows.features(); ++f)
      out.importance[f] += importance(t, f) / static_cast<double>(options.trees);
  return out;
}

}  // namespace

Result<PredictorPtr> fit_tree(const TrainingSet& training, const TrainOptions& options) {
  const RankedRows rows(training.rows(), training.of_row(), training.classes());
  std::vector<std::uint32_t> all(rows.rows());
  std::iota(all.begin(), all.end(), 0U);
  RandomEngine engine(options.seed);
  std::vector<DecisionTree> one;
  one.push_back(DecisionTree::grow(rows, std::move(all), {rows.features()}, engine, {}));
  return std::make_unique<TreeEnsemble>(rows.features(), training.classes(), std::move(one));
}

Result<PredictorPtr> fit_forest(const TrainingSet& training, const TrainOptions& options) {
  auto grown = grow_forest(training, options);
  if (!grown) return pass(grown.error());
  return std::make_unique<TreeEnsemble>(training.rows().cols(), training.classes(),
                                        std::move(grown->trees));
}

Result<PredictorPtr> fit_extra_trees(const TrainingSet& training, const TrainOptions& options) {
  auto trees = fit_extra_trees(training.rows(), training.of_row(), training.classes(), options,
                               options.trees);
  if (!trees) return pass(trees.error());
  return std::make_unique<TreeEnsemble>(std::move(*trees));
}

Result<std::vector<double>> forest_importance(const TrainingSet& training,
                                              const TrainOptions& options) {
  auto grown = grow_forest(training, options);
  if (!grown) return pass(grown.error());
  return std::move(grown->importance);
}

}  // namespace weft::classifier
