#pragma once
// How often "none of these" is right: every fabric in turn is left out of the model and shown to
// it.

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "classifier/base/interval.hpp"
#include "classifier/fabric/model.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/vote/novelty.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Test trials of one fabric, shown to a model that never met it.
struct LeftOut {
  std::string label;
  std::size_t trials = 0;
  std::size_t accepted = 0;  ///< taken for one of the others
};

/// One reject rule over all fabrics left out in turn.
struct RejectRates {
  RejectKind kind = RejectKind::neighbour;
  std::vector<LeftOut> left_out;   ///< one per fabric
  double false_accept = 0.0;       ///< accepted unknown trials / unknown trials
  Interval false_accept_ci95;      ///< Wilson, trials taken as independent
  double false_reject = 0.0;       ///< refused known trials / known trials, over all models
  double right_of_accepted = 0.0;  ///< known trials that were accepted: share of right answers
  /// Probability that an unknown trial scores stranger than a known one, ties half: what a rule can
  /// tell at all, whatever its threshold. 0.5 is nothing.
  double separation = 0.0;
};

/// Thresholds are learnt on `train` without the fabric, figures counted on `test`. Cores know two
/// fabrics only, so leaving one out means leaving its cores out; nothing is trained again but on
/// the folds. Refuses what train() and fit_postprocessing() refuse, fewer than three labels, test
/// labels that were not trained, and no test rows.
Result<std::array<RejectRates, reject_kinds>> measure_reject(const FeatureMatrix& train_part,
                                                             const FeatureMatrix& test_part,
                                                             const TrainOptions& options,
                                                             double false_reject = 0.05);

/// The model as it would be without a fabric; `label_index` below labels().size(), at least three
/// labels.
FabricModel without_label(const FabricModel& model, std::size_t label_index);

}  // namespace weft::classifier
