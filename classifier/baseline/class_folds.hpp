#pragma once
// Folds of a cross-validation of more than two classes.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "classifier/fabric/options.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/learn/folds.hpp"

namespace weft::classifier {

/// The classes of rows as numbers: place in the sorted list of distinct labels.
struct Classes {
  std::vector<std::string> labels;  ///< sorted
  std::vector<std::size_t> of_row;
};
Classes classes_of(const FeatureMatrix& matrix);

/// Stratified folds: every row validates once, units stay together, and every fold trains on at
/// least two rows of every class (as a core needs). At most `folds`; fewer where a class has fewer
/// units; where units are too few for that, rows are dealt singly; nothing where rows are too few
/// as well (a class with two rows). Reproducible from the seed.
std::vector<Fold> class_folds(std::span<const std::size_t> of_row,
                              std::span<const std::size_t> unit, std::size_t folds,
                              std::uint64_t seed);

}  // namespace weft::classifier
