#pragma once
// Which trials train and which test, and how often each label was recognised. A recording is never
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

/// count[t x classes + p]: trials of class t that were taken for class p.
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
  /// Share of each class's trials that were recognised; 0 for a class without trials.
  [[nodiscard]] std::vector<double> recall() const;
  /// Its mean over the classes that were tested: the accuracy if all had as many trials.
  [[nodiscard]] double balanced_accuracy() const;
  /// Share of the most frequent class: what naming it always would give.
  [[nodiscard]] double base_rate() const;

 private:
  [[nodiscard]] std::size_t tested(std::size_t truth) const;
};

/// Row numbers, ascending.
struct Split {
  std::vector<std::size_t> train;
  std::vector<std::size_t> test;
  bool whole_group = false;  ///< what tests is one group that no other split tests
};

/// The different labels of these rows.
std::set<std::string> labels_in(const FeatureMatrix& matrix, std::span<const std::size_t> rows);

SplitSizes size_of(const Split& split);
/// Means over at least one split.
SplitSizes mean_sizes(std::span<const Split> splits);

/// Groups of which any split has rows on both sides, sorted; rows without a group have none. What
/// the trials of a group have in common besides their label helps to recognise them.
std::vector<std::string> groups_on_both_sides(std::span<const Split> splits,
                                              std::span<const std::string> groups);

/// `repeats` random splits: of every label round(fraction x n) trials train, at least 2 and, where
/// there are three or more, at most n - 1; the rest tests. Random within labels, so only for data
/// whose trials are independent recordings. Refuses fraction outside (0, 1), no repeats, a label
/// with fewer than two trials, and two trials of every label, of which none is left to test.
Result<std::vector<Split>> stratified_splits(std::span<const std::string> labels, double fraction,
                                             std::size_t repeats, std::uint64_t seed);

/// Trials of `train_groups` train, those of `test_groups` test, others are left out.
/// Refuses empty lists, a group on both sides, a group that no trial has.
Result<Split> grouped_split(std::span<const std::string> groups,
                            std::span<const std::string> train_groups,
                            std::span<const std::string> test_groups);

/// One split per group, in the order of their names: that group tests, all others train. Test
/// trials of labels that no other group has are left out. Refuses fewer than two groups, trials
/// without a group, and groups of which nothing is left to test.
Result<std::vector<Split>> leave_one_group_out(std::span<const std::string> groups,
                                               std::span<const std::string> labels);

/// A label that no split tests: figures say nothing of it.
struct NeverTested {
  std::string label;
  std::size_t recordings = 0;  ///< windows of one (recording_of()) count once
  std::string group;           ///< the only one that has it; empty where there is no such group
};
/// By label.
std::vector<NeverTested> never_tested(std::span<const Split> splits,
                                      std::span<const std::string> labels,
                                      std::span<const std::string> groups,
                                      std::span<const std::string> files);

/// The splits with at most `recordings` training recordings of every label, drawn `draws` times
/// each from the seed; test parts stay as they are. Windows of one recording (recording_of())
/// count once and stay together. Refuses 0 of either and a label with fewer recordings.
Result<std::vector<Split>> thinned(std::span<const Split> splits,
                                   std::span<const std::string> labels,
                                   std::span<const std::string> files, std::size_t recordings,
                                   std::size_t draws, std::uint64_t seed);

/// The labels in random order: what a classifier must not be able to learn.
std::vector<std::string> permuted_labels(std::span<const std::string> labels, std::uint64_t seed);

// Test rows that training has seen under another name.

/// Test rows with a twin: a training row of the same split with the same features to the last bit,
/// from a recording that is a copy. What a learner says of them is no test of it. Two recordings
/// are copies when they have more than half of the different rows of the shorter one in common:
/// windows of silence are all one row, and make none.
struct DuplicateRows {
  std::size_t tested = 0;         ///< test rows, each counted in every split that tests it
  std::size_t found = 0;          ///< of these, those with a twin
  std::size_t contradicting = 0;  ///< of these, those with a twin of another label
  std::string test;   ///< file of the first one, of a contradicting one if any; empty: none
  std::string train;  ///< and of its twin
};
DuplicateRows find_duplicates(const FeatureMatrix& matrix, std::span<const Split> splits);

}  // namespace weft::classifier
