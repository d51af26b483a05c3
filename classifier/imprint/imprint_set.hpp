#pragma once
// Imprints with what is known about each, and the feature matrix of them all.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "classifier/features/feature_matrix.hpp"
#include "classifier/imprint/feature_plan.hpp"

namespace weft::classifier::imprint {

struct Imprint {
  Image image;
  std::string file;    ///< where it came from; unique in its set
  std::string label;   ///< class: knit
  std::string object;  ///< what was pressed: KNIT2; all its imprints are of one class
};

/// One row an imprint, groups are the objects. Refuses no imprint, what PlannedFeatures refuses,
/// and what an extraction refuses (named by file). `threads` 0: one per core.
Result<FeatureMatrix> build_matrix(std::span<const Imprint> imprints, const FeaturePlan& plan,
                                   std::size_t threads = 0);
/// The paper's features at the options' scales.
Result<FeatureMatrix> build_matrix(std::span<const Imprint> imprints, const ScaleOptions& options,
                                   std::size_t threads = 0);

/// Classes in the order of their first row, which is that in which equal products are decided, and
/// the class of every row.
struct Classes {
  std::vector<std::string> names;
  std::vector<std::size_t> of_row;
};
Classes find_classes(std::span<const std::string> labels);

/// The named columns, in the order given.
FeatureMatrix select_columns(const FeatureMatrix& matrix, std::span<const std::size_t> columns);

// The array that imprints are read from, as far as a model of imprints needs to know it.

/// An array, or the part of it that is scanned.
struct TaxelGrid {
  std::size_t rows = 0, cols = 0;
  double pitch_m = 0.0;        ///< from one taxel to the next; 0: not known
  std::size_t count_bits = 0;  ///< of a count; 0: not known
};

/// Imprints of both may be compared: as many rows and columns, and where both know it, a pitch that
/// is the same to 1 % (features are of scales in taxels) and as many bits.
bool is_same_grid(const TaxelGrid& a, const TaxelGrid& b);

/// "32 x 32 taxels, 0.281 mm apart, counts of 7 bits".
std::string format_grid(const TaxelGrid& grid);

/// Refuses an imprint of another size, and where the bits are known one with a count that they do
/// not hold.
Status check_imprint(const TaxelGrid& grid, const Imprint& imprint);

}  // namespace weft::classifier::imprint
