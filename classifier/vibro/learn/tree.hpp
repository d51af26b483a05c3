#pragma once
// A decision tree as scikit-learn grows it: CART (Breiman et al. 1984), Gini impurity, every leaf
// pure unless its rows cannot be told apart.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "classifier/learn/random.hpp"
#include "classifier/vibro/learn/method.hpp"

namespace weft::classifier::vibro {

/// Rows in the order of every feature: trees compare ranks, which is faster than values.
class RankedRows {
 public:
  explicit RankedRows(const Training& training);

  [[nodiscard]] std::size_t rows() const { return rows_; }
  [[nodiscard]] std::size_t features() const { return features_; }
  [[nodiscard]] std::size_t classes() const { return classes_; }
  [[nodiscard]] std::uint32_t class_of(std::size_t row) const { return class_[row]; }
  /// Equal values have equal ranks.
  [[nodiscard]] std::uint32_t rank(std::size_t feature, std::size_t row) const {
    return rank_[feature * rows_ + row];
  }
  [[nodiscard]] double value(std::size_t feature, std::uint32_t rank) const {
    return value_[feature * rows_ + rank];
  }

 private:
  std::size_t rows_, features_, classes_;
  std::vector<std::uint32_t> class_, rank_;  // rank_ [features x rows]
  std::vector<double> value_;                // [features x rows], by rank
};

class DecisionTree {
 public:
  /// From the given rows, which may be named more than once; `tried` features are looked at for
  /// each split, more while none of them differs among the rows. What each feature took off the
  /// impurity, weighted by the share of rows, is added to `importance` [features] where that is not
  /// empty; the sum is 1 (0 for a single leaf).
  static DecisionTree grow(const RankedRows& rows, std::vector<std::uint32_t> chosen,
                           std::size_t tried, RandomEngine& engine, std::span<double> importance);

  /// Adds the share of each class in the leaf that a row comes to.
  void add_shares(std::span<const double> features, std::span<double> shares) const;
  [[nodiscard]] std::size_t leaves() const { return (nodes_.size() + 1) / 2; }

  /// As lines of a stored model.
  void write(LineWriter& out) const;
  /// What write() wrote; `in` keeps the first problem.
  static DecisionTree read(LineReader& in, std::size_t features, std::size_t classes);

 private:
  friend class TreeGrower;
  struct Node {
    double threshold = 0.0;     // at or below goes to `child`, above to child + 1
    std::int32_t feature = -1;  // -1: a leaf
    std::uint32_t child = 0;    // of a pure leaf its class, of another classes + row of shares_
  };
  std::size_t classes_ = 0;
  std::vector<Node> nodes_;
  std::vector<double> shares_;  // of leaves that are not pure
};

/// Of one tree that looks at all features.
Result<std::unique_ptr<Classifier>> fit_tree(const Training& training,
                                             const MethodOptions& options);
/// The mean of the trees' shares.
Result<std::unique_ptr<Classifier>> fit_forest(const Training& training,
                                               const MethodOptions& options);

/// What the write() of a tree or a forest wrote; null where `in` has a problem.
std::unique_ptr<Classifier> read_trees(LineReader& in, std::size_t features, std::size_t classes);

/// Mean over the trees of a forest of what each feature took off the impurity; sum 1. This is how
/// the paper ranked its ten features.
Result<std::vector<double>> forest_importance(const Training& training,
                                              const MethodOptions& options);

}  // namespace weft::classifier::vibro
