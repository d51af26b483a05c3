#pragma once
// Many decision trees that answer together: what a distribution's tails and scales do not disturb.

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "classifier/base/matrix.hpp"
#include "classifier/fabric/options.hpp"
#include "classifier/learners/decision_tree.hpp"
#include "classifier/learners/predictor.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Immutable; may be used by several threads.
class TreeEnsemble final : public Predictor {
 public:
  /// `trees` at least one, of the same numbers of features and classes.
  TreeEnsemble(std::size_t features, std::size_t classes, std::vector<DecisionTree> trees)
      : features_(features), classes_(classes), trees_(std::move(trees)) {}

  [[nodiscard]] const std::vector<DecisionTree>& trees() const { return trees_; }
  /// Mean over the trees of the share of each class in the leaf that a row comes to; the sum is 1.
  /// As many features as the training had, all finite.
  [[nodiscard]] std::vector<double> shares(std::span<const double> features) const;
  /// ln of shares(); one below half a tree's counts as half a tree, so that all are finite. Refuses
  /// a vector of another length.
  [[nodiscard]] Result<ClassScores> predict(std::span<const double> features) const override;
  /// Class of the largest share; the lowest of several.
  [[nodiscard]] Result<std::size_t> classify(std::span<const double> features) const override;

  /// Those that a tree splits on.
  [[nodiscard]] std::vector<std::size_t> used_columns() const override;
  void write(LineWriter& out) const override;
  /// What write() wrote; `in` keeps the first problem, and without one there is at least one tree.
  static TreeEnsemble read(LineReader& in, std::size_t features, std::size_t classes);

 private:
  [[nodiscard]] std::vector<double> sums(std::span<const double> features) const;

  std::size_t features_ = 0;
  std::size_t classes_ = 0;
  std::vector<DecisionTree> trees_;
};

/// Grows trees on options.threads threads; `grow` is called with the number of each. Errors:
/// wrong_state, when options.stop says so; it is asked before each.
Result<std::vector<DecisionTree>> grow_trees(
    std::size_t trees, const TrainOptions& options,
    const std::function<DecisionTree(std::size_t tree)>& grow);

/// On the training parts of five real data sets 1000 made 931 errors in cross-validation where 300
/// made 950; as many as the forest of the 2023 paper has.
inline constexpr std::size_t extra_trees = 1000;

/// Extremely randomised trees (Geurts, Ernst and Wehenkel 2006, Machine Learning 63): each grown on
/// all rows, a split is the best of one random threshold in each of sqrt(F) features. As
/// scikit-learn's ExtraTreesClassifier, but for its random numbers, its default of 100 trees, and
/// features in single precision, of which it passes over those that differ by less than 1e-7. From
/// options.seed; the same with any number of threads. `of_row`: class of every row, below
/// `classes`. Values finite.
Result<TreeEnsemble> fit_extra_trees(const Matrix& rows, std::span<const std::size_t> of_row,
                                     std::size_t classes, const TrainOptions& options,
                                     std::size_t trees = extra_trees);

}  // namespace weft::classifier
