#pragma once
// Many decision trees that predict together; insensitive to the tails and scales of a distribution.

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
  /// `trees`: at least one, all with the same numbers of features and classes.
  TreeEnsemble(std::size_t features, std::size_t classes, std::vector<DecisionTree> trees)
      : features_(features), classes_(classes), trees_(std::move(trees)) {}

  [[nodiscard]] const std::vector<DecisionTree>& trees() const { return trees_; }
  /// Mean over the trees of the class shares in the leaf that a row reaches; the sum is 1. As many
  /// features as in the training, all finite.
  [[nodiscard]] std::vector<double> shares(std::span<const double> features) const;
  /// ln of shares(). A share below half a tree counts as half a tree, so that all are finite.
  /// Refuses a vector of another length.
  [[nodiscard]] Result<ClassScores> predict(std::span<const double> features) const override;
  /// Class of the largest share; the lowest class wins a tie.
  [[nodiscard]] Result<std::size_t> classify(std::span<const double> features) const override;

  /// Columns that a tree splits on.
  [[nodiscard]] std::vector<std::size_t> used_columns() const override;
  void write(LineWriter& out) const override;
  /// Reads the lines of write(), at least one tree; problems are recorded in `in`.
  static TreeEnsemble read(LineReader& in, std::size_t features, std::size_t classes);

 private:
  [[nodiscard]] std::vector<double> sums(std::span<const double> features) const;

  std::size_t features_ = 0;
  std::size_t classes_ = 0;
  std::vector<DecisionTree> trees_;
};

/// Grows trees on options.threads threads; `grow` is called with the number of each tree. Errors:
/// wrong_state if options.stop requests it; options.stop is called before each tree.
Result<std::vector<DecisionTree>> grow_trees(
    std::size_t trees, const TrainOptions& options,
    const std::function<DecisionTree(std::size_t tree)>& grow);

/// On the training parts of five real data sets 1000 trees made 931 errors in cross-validation; 300
/// made 950. The forest of the 2023 paper has the same number.
inline constexpr std::size_t extra_trees = 1000;

/// Extremely randomised trees (Geurts, Ernst and Wehenkel 2006, Machine Learning 63). Each grows on
/// all rows; a split is the best of one random threshold in each of sqrt(F) features. Like
/// scikit-learn's ExtraTreesClassifier, with other random numbers. scikit-learn has 100 trees by
/// default and features in single precision, and ignores those that differ by less than 1e-7.
/// Seeded by options.seed; the same with any number of threads. `of_row`: class of every row, below
/// `classes`. Values finite.
Result<TreeEnsemble> fit_extra_trees(const Matrix& rows, std::span<const std::size_t> of_row,
                                     std::size_t classes, const TrainOptions& options,
                                     std::size_t trees = extra_trees);

}  // namespace weft::classifier
