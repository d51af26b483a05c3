#pragma once
// Splits into training and test trials, and the counts of right predictions. A recording is never
// on both sides: trials of one group stay together.

#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "classifier/base/interval.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// count[t x classes + p]: trials of class t predicted as class p.
struct Confusion {
  std::vector<std::string> labels;
  std::vector<std::size_t> count;

  explicit Confusion(std::vector<std::string> names)
      : labels(std::move(names)), count(labels.size() * labels.size()) {}

  [[nodiscard]] std::size_t classes() const { return labels.size(); }
  std::size_t& at(std::size_t truth, std::size_t predicted) {
    return count[truth * classes() + predicted];
  }
  [[nodiscard]] std::size_t at(std::size_t truth, std::size_t predicted) const {
    return count[truth * classes() + predicted];
  }
  [[nodiscard]] std::size_t total() const;
  [[nodiscard]] std::size_t correct() const;
  /// Share of correct trials; 0 without trials.
  [[nodiscard]] double accuracy() const;
  /// Share of each class's trials that were predicted right; 0 for a class without trials.
  [[nodiscard]] std::vector<double> recall() const;
  /// Mean recall over the tested classes: the accuracy if all classes had equally many trials.
  [[nodiscard]] double balanced_accuracy() const;
  /// Share of the most frequent class: the accuracy of always predicting it.
  [[nodiscard]] double base_rate() const;

 private:
  [[nodiscard]] std::size_t tested(std::size_t truth) const;
};

/// Row numbers, ascending.
struct Split {
  std::vector<std::size_t> train;
  std::vector<std::size_t> test;
  bool whole_group = false;  ///< the test part is one group that no other split tests
};

/// The distinct labels of these rows.
std::set<std::string> labels_in(const FeatureMatrix& matrix, std::span<const std::size_t> rows);

SplitSizes size_of(const Split& split);
/// Means over the splits; needs at least one split.
SplitSizes mean_sizes(std::span<const Split> splits);

/// Groups with rows on both sides of any split, sorted; rows without a group do not count. Features
/// that the trials of a group share, besides the label, make them easier to predict.
std::vector<std::string> groups_on_both_sides(std::span<const Split> splits,
                                              std::span<const std::string> groups);

/// `repeats` random splits. For every label round(fraction x n) trials train: at least 2, and at
/// most n - 1 where n >= 3. The rest tests. The choice within a label is random, so use it only for
/// independent recordings. Refuses fraction outside (0, 1), no repeats, a label with fewer than two
/// trials, and two trials of every label (nothing is left to test).
Result<std::vector<Split>> stratified_splits(std::span<const std::string> labels, double fraction,
                                             std::size_t repeats, std::uint64_t seed);

/// Trials of `train_groups` train, those of `test_groups` test, others are left out. Refuses empty
/// lists, a group on both sides, a group without trials.
Result<Split> grouped_split(std::span<const std::string> groups,
                            std::span<const std::string> train_groups,
                            std::span<const std::string> test_groups);

/// One split per group, in the order of their names: that group tests, all others train. Test
/// trials of labels that only this group has are left out. Refuses fewer than two groups, trials
/// without a group, and groups with nothing left to test.
Result<std::vector<Split>> leave_one_group_out(std::span<const std::string> groups,
                                               std::span<const std::string> labels);

/// A label that no split tests; the figures do not cover it.
struct NeverTested {
  std::string label;
  std::size_t recordings = 0;  ///< windows of one (recording_of()) count once
  std::string group;           ///< the only group with this label; empty if several have it
};
/// Sorted by label.
std::vector<NeverTested> never_tested(std::span<const Split> splits,
                                      std::span<const std::string> labels,
                                      std::span<const std::string> groups,
                                      std::span<const std::string> files);

/// The splits with at most `recordings` training recordings of every label, drawn `draws` times
/// each from the seed. Test parts do not change. Windows of one recording (recording_of()) count
/// once and stay together. Refuses 0 of either and a label with fewer recordings.
Result<std::vector<Split>> thinned(std::span<const Split> splits,
                                   std::span<const std::string> labels,
                                   std::span<const std::string> files, std::size_t recordings,
                                   std::size_t draws, std::uint64_t seed);

/// The labels in random order; no classifier can learn them.
std::vector<std::string> permuted_labels(std::span<const std::string> labels, std::uint64_t seed);

// Test rows that are also in the training part, under another file name.

/// Test rows with a duplicate: a training row of the same split with bit-identical features, from a
/// recording that is a copy. The prediction of such a row is no test. Two recordings are copies if
/// they share more than half of the distinct rows of the shorter one. All windows of silence are
/// one distinct row, so silence alone makes no copy.
struct DuplicateRows {
  std::size_t tested = 0;         ///< test rows, each counted in every split that tests it
  std::size_t found = 0;          ///< of these, rows with a duplicate
  std::size_t contradicting = 0;  ///< of these, rows with a duplicate of another label
  std::string test;   ///< file of the first such row, preferably a contradicting one; empty: none
  std::string train;  ///< file of its duplicate
};
DuplicateRows find_duplicates(const FeatureMatrix& matrix, std::span<const Split> splits);

}  // namespace weft::classifier
