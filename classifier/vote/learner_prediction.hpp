#pragma once
// Everything known about one trial, whichever learner is asked.

#include <optional>
#include <span>
#include <vector>

#include "classifier/baseline/learner.hpp"
#include "classifier/vote/postprocessing.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Aids of any learner, from its own training rows; `options` are those of the training, `cap` that
/// of the recipe. Cores: as fit_postprocessing() of the model, on compressed features where it
/// takes those; the scaling before the compression is then that of all training rows, so rows held
/// out have a say in it (mean and deviation only; their labels do not enter). LDA, SVC and trees
/// are trained again on class_folds() with the parameters they have; their scores of rows held out
/// are sharpened until they are the likeliest probabilities (softmax of the LDA's discriminants, of
/// the SVC's sums of tanh(f), of ln of the trees' shares). Nothing where there are no such folds: a
/// probability would be of the training rows' own fit. Refuses what fit_postprocessing() refuses.
Result<std::optional<VotePostprocessing>> fit_postprocessing(const TrainedLearner& learner,
                                                             const FeatureMatrix& matrix,
                                                             const TrainOptions& options,
                                                             double false_reject = 0.05);

/// Without `postprocessing`: no probability and nothing refused. Kinds of vote are for cores:
/// another learner refuses all but VoteKind::majority, and has no votes (LDA, trees) or its own
/// (SVC). Refuses what predict() of the cores refuses.
Result<Prediction> predict(const TrainedLearner& learner,
                           const std::optional<VotePostprocessing>& postprocessing,
                           std::span<const double> features, const VoteOptions& options = {});

/// predict() of every row, the same but for Ballot::decision, which is left empty: of 500 classes
/// it is a megabyte. All cores are asked for some rows at a time, which for many classes is several
/// times as fast as row by row. One result per row; a trial that cannot be answered does not stop
/// the others.
std::vector<Result<Prediction>> predict_all(const TrainedLearner& learner,
                                            const std::optional<VotePostprocessing>& postprocessing,
                                            const Matrix& rows, const VoteOptions& options = {},
                                            std::size_t threads = 0);

}  // namespace weft::classifier
