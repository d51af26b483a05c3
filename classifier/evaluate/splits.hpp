#pragma once
// Which trials train and which test. A recording is never on both sides: trials of one group stay
// together.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "classifier/base/interval.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Row numbers, ascending.
struct Split {
  std::vector<std::size_t> train;
  std::vector<std::size_t> test;
};

SplitSizes size_of(const Split& split);
/// Means over at least one split.
SplitSizes mean_sizes(std::span<const Split> splits);

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

}  // namespace weft::classifier
