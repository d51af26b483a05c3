#pragma once
// Imprints with what is known about each, and the feature matrix of them all.

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

}  // namespace weft::classifier::imprint
