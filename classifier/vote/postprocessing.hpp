#pragma once
// What a model needs beside its cores to say how sure it is, and when none of its fabrics fits. All
// of it is learnt from the training part.

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "classifier/base/line_io.hpp"
#include "classifier/fabric/model.hpp"
#include "classifier/learners/learner.hpp"
#include "classifier/vote/calibration.hpp"
#include "classifier/vote/novelty.hpp"
#include "classifier/vote/vote.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

struct VotePostprocessing {
  ClassProfile profile;  ///< empty: nothing is refused, and `reject` says nothing
  Calibration calibration;
  RejectRule reject;
};

/// Answers on training rows by what was trained without them. One place per row asked.
struct HeldOut {
  std::vector<std::size_t> row;  ///< of the training matrix
  std::vector<std::size_t> winner;
  std::vector<std::vector<double>> probability;  ///< per class, not sharpened
};

/// The same with what turns scores into its probabilities: of cores their sigmoids.
struct CalibratedHeldOut {
  Calibration calibration;
  HeldOut rows;
};
/// Of any learner, as fit_postprocessing() trains it again. Nothing where there are no folds.
/// Refuses what fit_postprocessing() refuses.
Result<std::optional<CalibratedHeldOut>> predict_held_out(const TrainedLearner& learner,
                                                          const FeatureMatrix& matrix,
                                                          const TrainOptions& options);

/// What held-out answers teach: the sharpness, between 1/8 and 8, under which the true classes
/// `own` (per training row) are most likely, and the reject rule with its thresholds.
/// `postprocessing` has the profile and, of cores, the sigmoids. Nothing held out: the sharpness
/// stays, nothing is refused.
VotePostprocessing with_held_out(VotePostprocessing postprocessing, const HeldOut& held_out,
                                 const FeatureMatrix& matrix, std::span<const std::size_t> own,
                                 const TrainOptions& options, double false_reject);

/// `matrix` and `options` are those of the training. Cores are trained once more per fold, with the
/// parameters they have; up to 4 million decisions, of at least 200 rows, evenly spread, enter
/// sharpness and thresholds. Refuses what cross_decisions() refuses, and a share `false_reject` of
/// known trials to refuse outside (0, 1).
Result<VotePostprocessing> fit_postprocessing(const FabricModel& model, const FeatureMatrix& matrix,
                                              const TrainOptions& options,
                                              double false_reject = 0.05);

/// The same from decisions that are there already.
Result<VotePostprocessing> fit_postprocessing(const FabricModel& model, const FeatureMatrix& matrix,
                                              const CrossDecisions& decisions,
                                              const TrainOptions& options,
                                              double false_reject = 0.05);

/// Everything known about one trial.
struct Prediction {
  Ballot ballot;
  std::vector<double> probability;  ///< per class; empty for VoteKind::dag, a short-list of one
  Novelty novelty{};
  bool none_of_these = false;  ///< aids.reject refuses the trial; the ballot says what is nearest
};

/// `options.profile` need not be set. Refuses what vote() refuses.
Result<Prediction> predict(const FabricModel& model, const VotePostprocessing& postprocessing,
                           std::span<const double> features, VoteOptions options = {});

/// The same of a vote on these features that was held already.
Prediction postprocess(Ballot ballot, const VotePostprocessing& postprocessing,
                       std::span<const double> features);

// Vote aids as lines of a stored model.

/// One section; nothing is written as "aids 0", one without profile and reject rule as "aids 2".
void write_postprocessing(LineWriter& out, const std::optional<VotePostprocessing>& postprocessing);

/// The section back, bit for bit; `in` keeps the first problem. Sizes must fit the model's;
/// `sigmoids` is one per core, 0 for a learner without cores.
std::optional<VotePostprocessing> read_postprocessing(LineReader& in, std::size_t classes,
                                                      std::size_t features, std::size_t sigmoids);

// Everything known about one trial, whichever learner is asked.

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
