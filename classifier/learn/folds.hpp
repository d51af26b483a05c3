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

/// k = min(folds, rows of the smaller class) stratified folds of two classes (sign > 0 and the
/// rest): every row validates once, the classes' shares differ by at most one row between folds,
/// fold sizes too. Reproducible from the seed. Both classes need two rows, so that k >= 2.
std::vector<Fold> stratified_folds(std::span<const int> sign, std::size_t folds,
                                   std::uint64_t seed);

}  // namespace weft::classifier
