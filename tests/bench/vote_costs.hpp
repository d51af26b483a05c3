#pragma once
// Costs of each kind of vote: accuracy and time on the same trials.

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
  std::size_t as_majority = 0;  ///< trials with the same prediction as the majority vote
  double accuracy = 0.0;
  double cores_per_trial = 0.0;    ///< decision values computed, mean
  double seconds_per_trial = 0.0;  ///< one at a time on the calling thread
};

/// Every kind of vote on every row, majority first. `profile` is that of the model's training rows;
/// if it is empty the short-list is skipped. `seconds_now` reads the caller's clock; if it is empty
/// the times are 0. Errors: no rows, other columns than the model's, a label that was not trained.
Result<std::vector<VoteCost>> compare_votes(const FabricModel& model, const ClassProfile& profile,
                                            const FeatureMatrix& matrix,
                                            const std::function<double()>& seconds_now = {},
                                            std::size_t shortlist = 20);

}  // namespace weft::classifier
