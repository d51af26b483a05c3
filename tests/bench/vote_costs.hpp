#pragma once
// What each kind of vote costs: accuracy and time on the same trials.

#include <cstddef>
#include <functional>
#include <vector>

#include "classifier/features/feature_matrix.hpp"
#include "classifier/vote/vote.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// One kind of vote on all trials of a test part.
struct VoteCost {
  VoteKind kind = VoteKind::majority;
  std::size_t correct = 0;
  std::size_t trials = 0;
  std::size_t as_majority = 0;  ///< trials with the answer of the majority
  double accuracy = 0.0;
  double cores_per_trial = 0.0;    ///< decision values computed, mean
  double seconds_per_trial = 0.0;  ///< one at a time on the calling thread
};

/// Every kind of vote on every row, majority first. `profile` of the model's training rows; empty:
/// the short-list is left out. `seconds_now` reads the caller's clock; empty: times are 0. Refuses
/// no rows, other columns than the model's, a label that was not trained.
Result<std::vector<VoteCost>> compare_votes(const FabricModel& model, const ClassProfile& profile,
                                            const FeatureMatrix& matrix,
                                            const std::function<double()>& seconds_now = {},
                                            std::size_t shortlist = 20);

}  // namespace weft::classifier
