#pragma once
// Accuracy of the unknown-fabric check: each fabric in turn is left out of the model and then
// classified by it.

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

/// Test trials of one fabric, classified by a model that was trained without it.
struct LeftOut {
  std::string label;
  std::size_t trials = 0;
  std::size_t accepted = 0;  ///< predicted as one of the other fabrics
};

/// One reject rule over all left-out fabrics.
struct RejectRates {
  RejectKind kind = RejectKind::neighbour;
  std::vector<LeftOut> left_out;   ///< one per fabric
  double false_accept = 0.0;       ///< accepted unknown trials / unknown trials
  Interval false_accept_ci95;      ///< Wilson, trials taken as independent
  double false_reject = 0.0;       ///< refused known trials / known trials, over all models
  double right_of_accepted = 0.0;  ///< share of right predictions among the accepted known trials
  /// Probability that an unknown trial scores higher than a known one, ties half: the quality of a
  /// rule independent of its threshold. 0.5 is useless.
  double separation = 0.0;
};

/// Thresholds are trained on `train_part` without the fabric, rates are counted on `test_part`. A
/// core has two fabrics only, so leaving a fabric out means leaving its cores out; only the folds
/// need new training. Errors: those of train() and fit_postprocessing(), fewer than three labels,
/// test labels that were not trained, no test rows.
Result<std::array<RejectRates, reject_kinds>> measure_reject(const FeatureMatrix& train_part,
                                                             const FeatureMatrix& test_part,
                                                             const TrainOptions& options,
                                                             double false_reject = 0.05);

/// The model without a fabric. `label_index` is below labels().size(); there are at least three
/// labels.
FabricModel without_label(const FabricModel& model, std::size_t label_index);

}  // namespace weft::classifier
