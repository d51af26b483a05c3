#include <algorithm>
#include <numeric>
#include <string>

#include "classifier/base/parallel.hpp"
#include "classifier/baseline/learner_text.hpp"
#include "classifier/baseline/tree_ensemble.hpp"
#include "classifier/vibro/learn/learners.hpp"

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

Result<Forest> grow_forest(const Training& training, const MethodOptions& options) {
  if (options.trees == 0)
    return fail({.code = Errc::invalid_argument,
                 .where = "RForest",
                 .what = "a forest needs a tree",
                 .expected = "at least 1",
                 .got = "0"});
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

// Names in the order of the classes: a learner's labels are sorted.
std::string name_of(std::size_t class_number) {
  const std::string digits = std::to_string(class_number);
  return std::string(8 - std::min<std::size_t>(8, digits.size()), '0') + digits;
}

std::vector<std::string> names_of(std::size_t count) {
  std::vector<std::string> out;
  for (std::size_t k = 0; k < count; ++k) out.push_back(name_of(k));
  return out;
}

class Fabric final : public Classifier {
 public:
  explicit Fabric(TrainedLearner trained) : trained_(std::move(trained)) {}
  // Rows are finite and of the right length, which is all that is refused.
  [[nodiscard]] std::size_t classify(std::span<const double> features) const override {
    return trained_.classify(features).value_or(0);
  }

  void write(LineWriter& out) const override {
    write_head(out, {trained_.kind(), trained_.view().kind()});
    write_learner(out, trained_);
  }

 private:
  TrainedLearner trained_;
};

}  // namespace

Result<ClassifierPtr> fit_tree(const Training& training, const MethodOptions& options) {
  const RankedRows rows(*training.rows, training.of_row, training.classes);
  std::vector<std::uint32_t> all(rows.rows());
  std::iota(all.begin(), all.end(), 0U);
  RandomEngine engine(options.seed);
  std::vector<DecisionTree> one;
  one.push_back(DecisionTree::grow(rows, std::move(all), {rows.features()}, engine, {}));
  return std::make_unique<Trees>(TreeEnsemble(rows.features(), training.classes, std::move(one)));
}

Result<ClassifierPtr> fit_forest(const Training& training, const MethodOptions& options) {
  auto grown = grow_forest(training, options);
  if (!grown) return pass(grown.error());
  return std::make_unique<Trees>(
      TreeEnsemble(training.rows->cols(), training.classes, std::move(grown->trees)));
}

ClassifierPtr read_trees(LineReader& in, std::size_t features, std::size_t classes) {
  auto trees = TreeEnsemble::read(in, features, classes);
  return in.ok() ? std::make_unique<Trees>(std::move(trees)) : nullptr;
}

Result<std::vector<double>> forest_importance(const Training& training,
                                              const MethodOptions& options) {
  auto grown = grow_forest(training, options);
  if (!grown) return pass(grown.error());
  return std::move(grown->importance);
}

Result<ClassifierPtr> fit_fabric(const Training& training, Learner learner,
                                 const MethodOptions& options) {
  FeatureMatrix matrix;
  matrix.values = *training.rows;
  matrix.names = names_of(matrix.values.cols());
  for (std::size_t r = 0; r < matrix.values.rows(); ++r) {
    matrix.labels.push_back(name_of(training.of_row[r]));
    matrix.groups.emplace_back();
    matrix.files.push_back(name_of(training.unit.empty() ? r : training.unit[r]));
  }
  TrainOptions own;
  own.threads = options.threads;
  auto trained = train_recipe(matrix, {learner, own.cap}, own);
  if (!trained) return pass(trained.error());
  return std::make_unique<Fabric>(std::move(*trained));
}

ClassifierPtr read_fabric(LineReader& in, std::size_t features, std::size_t classes) {
  const LearnerHead head = read_head(in);
  auto trained = read_learner(in, head, names_of(classes), names_of(features));
  if (!trained || !in.ok()) return nullptr;
  return std::make_unique<Fabric>(std::move(*trained));
}

}  // namespace weft::classifier::vibro
