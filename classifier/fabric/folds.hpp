#pragma once
// Units that stay together in a fold, and the units by which the rows of a label can be dealt.

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "classifier/fabric/options.hpp"
#include "classifier/features/feature_matrix.hpp"

namespace weft::classifier {

/// Stratified folds of two classes (sign > 0 and the rest). Every row validates once. Rows of one
/// `unit` (windows of one recording, trials of one session) stay together, even if a unit has both
/// classes. Every fold trains on both classes. With one row per unit the classes' shares differ by
/// at most one row between folds. k = min(folds, units of either class); if a class has a single
/// unit the rows are dealt singly. If a fold would have fewer than `least_fold_rows` training rows
/// (two trials of each class), every unit is its own fold; if that is not enough, every row is.
/// Reproducible from the seed. Both classes need two rows.
std::vector<Fold> stratified_folds(std::span<const int> sign, std::span<const std::size_t> unit,
                                   std::size_t folds, std::uint64_t seed);

/// A number per row, equal for rows that a fold keeps together: windows of one recording
/// (recording_of()), or with FoldUnit::group all rows of a group. A row without a name is its own
/// unit.
std::vector<std::size_t> row_units(const FeatureMatrix& matrix, FoldUnit kind);

/// The class of each row as an index into the sorted list of distinct labels.
struct Classes {
  std::vector<std::string> labels;  ///< sorted
  std::vector<std::size_t> of_row;
};
Classes find_classes(const FeatureMatrix& matrix);
/// Row numbers of every class, ascending; the result has at least `classes` lists.
std::vector<std::vector<std::size_t>> rows_by_class(std::span<const std::size_t> of_row,
                                                    std::size_t classes = 0);

/// For each level, coarse to fine, the unit of every row; unit numbers are below the number of
/// rows.
using UnitLevels = std::vector<std::vector<std::size_t>>;

/// Groups (with FoldUnit::group), recordings, their parts (if the matrix has them), single rows.
UnitLevels unit_levels(const FeatureMatrix& matrix, FoldUnit kind);

/// The first level, from `from` on, where at least `least` rows of the class remain for training
/// whichever unit is held out; levels.size() if there is none.
std::size_t first_level(const UnitLevels& levels, std::span<const std::size_t> rows_of_class,
                        std::size_t least, std::size_t from = 0);

/// Units of rows with a separate level for each class. The numbers equal those of levels[0] if all
/// classes are at level 0. Units of different levels have different numbers.
std::vector<std::size_t> units_at(const UnitLevels& levels, std::span<const std::size_t> of_row,
                                  std::span<const std::size_t> level_of_class);

/// Units that a core's folds keep together: units of `kind`. A label with a single such unit is
/// split finer: into recordings or, if it has only one recording, into single rows.
struct LabelUnits {
  std::vector<std::size_t> of_row;
  std::vector<std::size_t> level;  ///< per label (sorted): index into unit_levels()
};
LabelUnits units_by_label(const FeatureMatrix& matrix, FoldUnit kind);

// The training rows of one core, their signs and the folds of its cross-validation.

using RowsOfLabel = std::map<std::string, std::vector<std::size_t>>;

/// Row numbers of every label, ascending.
RowsOfLabel rows_by_label(const FeatureMatrix& matrix);

/// Checks the labels of the training rows. Refuses fewer than two labels, and a label with fewer
/// than `least` rows.
Status check_labels(std::span<const std::string> labels, std::size_t least = 2);

/// Training problem of a core; `sign` and `folds` use positions in `rows`.
struct PairProblem {
  std::vector<std::size_t> rows;  ///< rows of the matrix: class a, then class b
  std::vector<int> sign;          ///< +1 for class a, -1 for class b
  std::vector<Fold> folds;        ///< of options.make_folds, or stratified by units_by_label()
};

/// Makes the problems of one matrix, pair after pair. Folds depend only on the pattern of signs and
/// units. So a pair with the pattern of the last one reuses its folds.
class PairMaker {
 public:
  /// `options` is kept by reference.
  PairMaker(const FeatureMatrix& matrix, const TrainOptions& options);
  /// `a`, `b`: row numbers of the two classes. The result is valid until the next call.
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
