#pragma once
// A decision tree as in scikit-learn: CART (Breiman et al. 1984), Gini impurity. Every leaf is pure
// unless its rows have equal features. Forests consist of such trees.

#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <vector>

#include "classifier/base/line_io.hpp"
#include "classifier/base/matrix.hpp"
#include "classifier/base/random.hpp"

namespace weft::classifier {

/// Rows sorted by every feature: trees compare ranks, which is faster than values.
class RankedRows {
 public:
  /// `of_row`: class of every row, below `classes`. Values finite.
  RankedRows(const Matrix& rows, std::span<const std::size_t> of_row, std::size_t classes);

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
  /// The largest rank from `low` on with a value of at most `threshold`. The value of `low` must be
  /// at most `threshold`.
  [[nodiscard]] std::uint32_t last_at_most(std::size_t feature, std::uint32_t low,
                                           std::uint32_t high, double threshold) const;

 private:
  std::size_t rows_, features_, classes_;
  std::vector<std::uint32_t> class_, rank_;  // rank_ [features x rows]
  std::vector<double> value_;                // [features x rows], by rank
};

/// Rule by which a tree chooses its splits.
struct SplitRule {
  /// Features tested for each split, drawn anew; more while none of them differs among the rows.
  std::size_t tried = 1;
  /// True: one threshold per feature, drawn between its least and its largest value, instead of the
  /// best one. These are the extremely randomised trees of Geurts, Ernst and Wehenkel (2006).
  bool random_threshold = false;
};

class DecisionTree {
 public:
  /// Grows a tree from the given rows; a row may appear more than once. Adds to `importance`
  /// [features], unless empty, the decrease of impurity by each feature, weighted by the share of
  /// rows. The sum is 1 (0 for a single leaf).
  static DecisionTree grow(const RankedRows& rows, std::vector<std::uint32_t> chosen,
                           const SplitRule& rule, RandomEngine& engine,
                           std::span<double> importance);

  /// Adds the class shares of the leaf that the row reaches.
  void add_shares(std::span<const double> features, std::span<double> shares) const;
  /// Adds the features of the tree's splits.
  void add_features(std::set<std::size_t>& features) const;
  [[nodiscard]] std::size_t leaves() const { return (nodes_.size() + 1) / 2; }

  /// Writes the tree as lines of a stored model.
  void write(LineWriter& out) const;
  /// Reads the lines of write(); problems are recorded in `in`.
  static DecisionTree read(LineReader& in, std::size_t features, std::size_t classes);

 private:
  friend class TreeGrower;
  struct Node {
    double threshold = 0.0;     // values up to it go to `child`, larger ones to child + 1
    std::int32_t feature = -1;  // -1: a leaf
    std::uint32_t child = 0;    // pure leaf: its class; other leaf: classes + row of shares_
  };
  std::size_t classes_ = 0;
  std::vector<Node> nodes_;
  std::vector<double> shares_;  // shares of leaves that are not pure
};

/// Features tested for each split of a forest: the square root of their number, rounded down.
std::size_t features_of_a_split(std::size_t features);

/// The random engine of one tree; the same on any thread.
RandomEngine engine_of_tree(std::uint64_t seed, std::size_t tree);

}  // namespace weft::classifier
