#pragma once
// Folds of a cross-validation.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace weft::classifier {

/// Row numbers, ascending.
struct Fold {
  std::vector<std::size_t> train;
  std::vector<std::size_t> validate;
};

/// Fewest rows to select features from: the pooled t-test has n - 2 degrees of freedom.
inline constexpr std::size_t least_fold_rows = 3;

/// Stratified folds of two classes (sign > 0 and the rest): every row validates once. Rows of one
/// `unit` (windows of one recording, trials of one session) stay together, also where a unit holds
/// both classes; every fold trains on both classes. With one row per unit the classes' shares
/// differ by at most one row between folds. k = min(folds, units of either class); where a class
/// has a single unit the rows are dealt singly. Where that would leave a fold fewer than
/// `least_fold_rows` to train on (two trials of each class), every unit is a fold of its own, and
/// every row if that is not enough. Reproducible from the seed. Both classes need two rows.
std::vector<Fold> stratified_folds(std::span<const int> sign, std::span<const std::size_t> unit,
                                   std::size_t folds, std::uint64_t seed);

}  // namespace weft::classifier
