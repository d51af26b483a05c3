#pragma once
// Test rows that training has seen under another name.

#include <cstddef>
#include <span>
#include <string>

#include "classifier/evaluate/splits.hpp"
#include "classifier/features/feature_matrix.hpp"

namespace weft::classifier {

/// Test rows with a twin: a training row of the same split with the same features to the last bit,
/// from a recording that is a copy. What a learner says of them is no test of it. Two recordings
/// are copies when they have more than half of the different rows of the shorter one in common:
/// windows of silence are all one row, and make none.
struct DuplicateRows {
  std::size_t tested = 0;         ///< test rows, each counted in every split that tests it
  std::size_t found = 0;          ///< of these, those with a twin
  std::size_t contradicting = 0;  ///< of these, those with a twin of another label
  std::string test;   ///< file of the first one, of a contradicting one if any; empty: none
  std::string train;  ///< and of its twin
};
DuplicateRows find_duplicates(const FeatureMatrix& matrix, std::span<const Split> splits);

}  // namespace weft::classifier
