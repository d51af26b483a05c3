#pragma once
// What stays together in a fold, and by which of these units the rows of a label can be dealt.

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "classifier/fabric/options.hpp"
#include "classifier/features/feature_matrix.hpp"

namespace weft::classifier {

/// Stratified folds of two classes (sign > 0 and the rest): every row validates once. Rows of one
/// `unit` (windows of one recording, trials of one session) stay together, also where a unit holds
/// both classes; every fold trains on both classes. With one row per unit the classes' shares
/// differ by at most one row between folds. k = min(folds, units of either class); where a class
/// has a single unit the rows are dealt singly. Where that would leave a fold fewer than
/// `least_fold_rows` to train on (two trials of each class), every unit is a fold of its own, and
/// every row if that is not enough. Reproducible from the seed. Both classes need two rows.
std::vector<Fold> stratified_folds(std::span<const int> sign, std::span<const std::size_t> unit,
                                   std::size_t folds, std::uint64_t seed);

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
/// Row numbers of every class, ascending; of at least `classes` of them.
std::vector<std::vector<std::size_t>> rows_by_class(std::span<const std::size_t> of_row,
                                                    std::size_t classes = 0);

/// Units of every row, below the number of rows, from coarse to fine.
using UnitLevels = std::vector<std::vector<std::size_t>>;

/// Groups (where `kind` says so), recordings, their parts (where the matrix has them), single rows.
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

// The training rows of one core, their signs and the folds of its cross-validation.

using RowsOfLabel = std::map<std::string, std::vector<std::size_t>>;

/// Row numbers of every label, ascending.
RowsOfLabel rows_by_label(const FeatureMatrix& matrix);

/// Of every training row. Refuses fewer than two labels, and one of fewer than `least` rows.
Status check_labels(std::span<const std::string> labels, std::size_t least = 2);

/// What a core learns from: `sign` and `folds` count positions in `rows`.
struct PairProblem {
  std::vector<std::size_t> rows;  ///< of the matrix: class a, then class b
  std::vector<int> sign;          ///< +1 for class a, -1 for class b
  std::vector<Fold> folds;        ///< of options.make_folds, or stratified by units_by_label()
};

/// Pair after pair of one matrix. Folds depend on the pattern of signs and units alone, so those of
/// the last pair serve the next one of the same pattern.
class PairMaker {
 public:
  /// `options` is kept by reference.
  PairMaker(const FeatureMatrix& matrix, const TrainOptions& options);
  /// Row numbers of the two classes. What it returns is good until the next call.
  const PairProblem& make(const std::vector<std::size_t>& a, const std::vector<std::size_t>& b);

 private:
  [[nodiscard]] std::vector<std::size_t> pattern(const std::vector<std::size_t>& rows) const;

  const TrainOptions& options_;
  std::vector<std::size_t> unit_;  // per row of the matrix
  std::vector<std::size_t> last_pattern_;
  std::vector<int> last_sign_;
  PairProblem problem_;
};

}  // namespace weft::classifier
