#pragma once
// Which trials train and which test. A recording is never on both sides: trials of one group stay
// together.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Row numbers, ascending.
struct Split {
  std::vector<std::size_t> train;
  std::vector<std::size_t> test;
};

/// `repeats` random splits: of every label round(fraction x n) trials train (at least 2), the rest
/// tests. Random within labels, so only for data whose trials are independent recordings. Refuses
/// fraction outside (0, 1), no repeats, a label with fewer than two trials, an empty test part.
Result<std::vector<Split>> stratified_splits(std::span<const std::string> labels, double fraction,
                                             std::size_t repeats, std::uint64_t seed);

/// Trials of `train_groups` train, those of `test_groups` test, others are left out.
/// Refuses empty lists, a group on both sides, a group that no trial has.
Result<Split> grouped_split(std::span<const std::string> groups,
                            std::span<const std::string> train_groups,
                            std::span<const std::string> test_groups);

/// The labels in random order: what a classifier must not be able to learn.
std::vector<std::string> permuted_labels(std::span<const std::string> labels, std::uint64_t seed);

}  // namespace weft::classifier
