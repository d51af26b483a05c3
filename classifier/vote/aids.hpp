#pragma once
// What a model needs beside its cores to say how sure it is, and when none of its fabrics fits. All
// of it is learnt from the training part.

#include <optional>
#include <span>
#include <vector>

#include "classifier/fabric/model.hpp"
#include "classifier/vote/calibration.hpp"
#include "classifier/vote/class_profile.hpp"
#include "classifier/vote/novelty.hpp"
#include "classifier/vote/vote.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

struct VoteAids {
  ClassProfile profile;
  Calibration calibration;
  RejectRule reject;
};

/// `matrix` and `options` are those of the training. Cores are trained once more per fold, with the
/// parameters they have. Refuses what cross_decisions() refuses, and a share `false_reject` of
/// known trials to refuse outside (0, 1).
Result<VoteAids> learn_aids(const FabricModel& model, const FeatureMatrix& matrix,
                            const TrainOptions& options, double false_reject = 0.05);

/// The same from decisions that are there already.
Result<VoteAids> learn_aids(const FabricModel& model, const FeatureMatrix& matrix,
                            const CrossDecisions& held_out, const TrainOptions& options,
                            double false_reject = 0.05);

/// Everything known about one trial.
struct Answer {
  Ballot ballot;
  std::vector<double> probability;  ///< per class; empty for VoteKind::dag
  Novelty novelty{};
  bool none_of_these = false;  ///< aids.reject refuses the trial; the ballot says what is nearest
};

/// `options.profile` need not be set. Refuses what vote() refuses.
Result<Answer> answer(const FabricModel& model, const VoteAids& aids,
                      std::span<const double> features, VoteOptions options = {});

}  // namespace weft::classifier
