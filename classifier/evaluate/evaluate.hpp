#pragma once
// Train and test over one or more splits, and what Tables II to IV of Khan et al. 2016 show of it.

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "classifier/evaluate/confusion.hpp"
#include "classifier/evaluate/interval.hpp"
#include "classifier/evaluate/splits.hpp"
#include "classifier/fabric/model.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Reads a clock in seconds. The caller's: nothing here knows what time it is. Empty: times are
/// reported as 0.
using SecondsNow = std::function<double()>;

/// One training and test.
struct SplitOutcome {
  double accuracy = 0.0;
  double train_s = 0.0;            ///< all cores, grid search included
  double test_s_per_sample = 0.0;  ///< one trial at a time on one thread, vote included
};

struct Evaluation {
  Confusion confusion;  ///< summed over the splits
  std::vector<SplitOutcome> splits;
  double accuracy = 0.0;  ///< mean over the splits
  double deviation = 0.0;
  Interval ci95;
  double train_s = 0.0;            ///< mean over the splits
  double test_s_per_sample = 0.0;  ///< mean over the splits
  FabricModel model;  ///< of the first split: its cores illustrate the selection (Table III)
};

/// Refuses: what train() refuses, no split, an empty test part, a row beyond the last, a row on
/// both sides of a split, a test label that was not trained.
Result<Evaluation> evaluate(const FeatureMatrix& matrix, std::span<const Split> splits,
                            const TrainOptions& options, const SecondsNow& seconds_now = {});

}  // namespace weft::classifier
