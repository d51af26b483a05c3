#include "classifier/vibro/learn/learners.hpp"

#include <numeric>

#include "classifier/base/parallel.hpp"
#include "classifier/baseline/tree_ensemble.hpp"

namespace weft::classifier::vibro {
namespace {

class Trees final : public Classifier {
 public:
  explicit Trees(TreeEnsemble trees) : trees_(std::move(trees)) {}
  [[nodiscard]] std::size_t classify(std::span<const double> features) const override {
    return trees_.most(features);
  }
  void write(LineWriter& out) const override { trees_.write(out); }

 private:
  TreeEnsemble trees_;
};

// As many rows as there are, drawn with replacement.
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

Forest grow_forest(const Training& training, const MethodOptions& options) {
  const RankedRows rows(*training.rows, training.of_row, training.classes);
  const SplitRule rule{features_of_a_split(rows.features())};
  Forest out;
  out.trees.resize(options.trees);
  Matrix importance(options.trees, rows.features());
  parallel_for(options.trees, options.threads, [&](std::size_t t) {
    RandomEngine engine = engine_of_tree(options.seed, t);
    out.trees[t] =
        DecisionTree::grow(rows, drawn(rows.rows(), engine), rule, engine, importance.row(t));
  });
  out.importance.assign(rows.features(), 0.0);
  for (std::size_t t = 0; t < options.trees; ++t)
    for (std::size_t f = 0; f < rows.features(); ++f)
      out.importance[f] += importance(t, f) / static_cast<double>(options.trees);
  return out;
}

}  // namespace

Result<std::unique_ptr<Classifier>> fit_tree(const Training& training,
                                             const MethodOptions& options) {
  const RankedRows rows(*training.rows, training.of_row, training.classes);
  std::vector<std::uint32_t> all(rows.rows());
  std::iota(all.begin(), all.end(), 0U);
  RandomEngine engine(options.seed);
  std::vector<DecisionTree> one;
  one.push_back(DecisionTree::grow(rows, std::move(all), {rows.features()}, engine, {}));
  return std::make_unique<Trees>(TreeEnsemble(rows.features(), training.classes, std::move(one)));
}

Result<std::unique_ptr<Classifier>> fit_forest(const Training& training,
                                               const MethodOptions& options) {
  if (options.trees == 0)
    return fail({.code = Errc::invalid_argument,
                 .where = "RForest",
                 .what = "a forest needs a tree",
                 .expected = "at least 1",
                 .got = "0"});
  return std::make_unique<Trees>(
      TreeEnsemble(training.rows->cols(), training.classes, grow_forest(training, options).trees));
}

std::unique_ptr<Classifier> read_trees(LineReader& in, std::size_t features, std::size_t classes) {
  auto trees = TreeEnsemble::read(in, features, classes);
  return in.ok() ? std::make_unique<Trees>(std::move(trees)) : nullptr;
}

Result<std::vector<double>> forest_importance(const Training& training,
                                              const MethodOptions& options) {
  if (options.trees == 0)
    return fail({.code = Errc::invalid_argument,
                 .where = "RForest",
                 .what = "a forest needs a tree",
                 .expected = "at least 1",
                 .got = "0"});
  return grow_forest(training, options).importance;
}

}  // namespace weft::classifier::vibro
