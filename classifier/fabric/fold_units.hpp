#pragma once
// What stays together in a fold, and by which of these units the rows of a label can be dealt.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "classifier/fabric/options.hpp"
#include "classifier/features/feature_matrix.hpp"

namespace weft::classifier {

/// A number per row: equal for rows that a fold keeps together. Windows of one recording
/// (recording_of()), or with FoldUnit::group all rows of a group; a row without a name is its own
/// unit.
std::vector<std::size_t> row_units(const FeatureMatrix& matrix, FoldUnit kind);

/// The classes of rows as numbers: place in the sorted list of distinct labels.
struct Classes {
  std::vector<std::string> labels;  ///< sorted
  std::vector<std::size_t> of_row;
};
Classes find_classes(const FeatureMatrix& matrix);
/// Row numbers of every class, ascending.
std::vector<std::vector<std::size_t>> rows_by_class(std::span<const std::size_t> of_row);

/// Units of every row, below the number of rows, from coarse to fine.
using UnitLevels = std::vector<std::vector<std::size_t>>;

/// Groups (where `kind` says so), recordings, single rows.
UnitLevels unit_levels(const FeatureMatrix& matrix, FoldUnit kind);

/// From level `from` on the first of whose units any one may be held out so that `least` of the
/// rows of a class remain to train on; levels.size() where there is none.
std::size_t first_level(const UnitLevels& levels, std::span<const std::size_t> rows_of_class,
                        std::size_t least, std::size_t from = 0);

/// Units of rows of which each class is dealt by a level of its own. The numbers are those of the
/// level where all are at level 0; units of different levels are different.
std::vector<std::size_t> units_at(const UnitLevels& levels, std::span<const std::size_t> of_row,
                                  std::span<const std::size_t> level_of_class);

/// What a core's folds keep together: units of `kind`, but the rows of a label with a single one
/// finer, as recordings or, where it has one recording too, single rows.
struct LabelUnits {
  std::vector<std::size_t> of_row;
  std::vector<std::size_t> level;  ///< per label, sorted: of unit_levels()
};
LabelUnits units_by_label(const FeatureMatrix& matrix, FoldUnit kind);

}  // namespace weft::classifier
