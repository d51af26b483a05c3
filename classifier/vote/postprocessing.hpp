#pragma once
// The parts of a model beside its cores for probabilities and the open-set check. All of them are
// fitted to the training part.

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
  ClassProfile profile;  ///< empty: nothing is refused, and `reject` has no meaning
  Calibration calibration;
  RejectRule reject;
};

/// Predictions on training rows by learners trained without them. One entry per tested row.
struct HeldOut {
  std::vector<std::size_t> row;  ///< rows of the training matrix
  std::vector<std::size_t> winner;
  std::vector<std::vector<double>> probability;  ///< per class, not sharpened
};

/// The same with the calibration that turns scores into its probabilities: the sigmoids of cores.
struct CalibratedHeldOut {
  Calibration calibration;
  HeldOut rows;
};
/// Predictions of any learner, trained again as in fit_postprocessing(). Empty without folds.
/// Refuses what fit_postprocessing() refuses.
Result<std::optional<CalibratedHeldOut>> predict_held_out(const TrainedLearner& learner,
                                                          const FeatureMatrix& matrix,
                                                          const TrainOptions& options);

/// Fits to held-out predictions: the sharpness, between 1/8 and 8, with the largest likelihood of
/// the true classes `own` (per training row), and the reject rule with its thresholds.
/// `postprocessing` has the profile and, for cores, the sigmoids. Without held-out rows the
/// sharpness stays and nothing is refused.
VotePostprocessing with_held_out(VotePostprocessing postprocessing, const HeldOut& held_out,
                                 const FeatureMatrix& matrix, std::span<const std::size_t> own,
                                 const TrainOptions& options, double false_reject);

/// `matrix` and `options` are those of the training. Cores are trained once more per fold with
/// their parameters. Sharpness and thresholds use up to 4 million decisions, of at least 200 rows,
/// evenly spread. Refuses what cross_decisions() refuses, and a share `false_reject` of known
/// trials outside (0, 1).
Result<VotePostprocessing> fit_postprocessing(const FabricModel& model, const FeatureMatrix& matrix,
                                              const TrainOptions& options,
                                              double false_reject = 0.05);

/// The same with decisions that are already computed.
Result<VotePostprocessing> fit_postprocessing(const FabricModel& model, const FeatureMatrix& matrix,
                                              const CrossDecisions& decisions,
                                              const TrainOptions& options,
                                              double false_reject = 0.05);

/// The full prediction for one trial.
struct Prediction {
  Ballot ballot;
  std::vector<double> probability;  ///< per class; empty for VoteKind::dag, a short-list of one
  Novelty novelty{};
  bool none_of_these = false;  ///< the reject rule refuses the trial (unknown fabric); the ballot
                               ///< has the nearest class
};

/// `options.profile` need not be set. Refuses what vote() refuses.
Result<Prediction> predict(const FabricModel& model, const VotePostprocessing& postprocessing,
                           std::span<const double> features, VoteOptions options = {});

/// The same for an existing vote on these features.
Prediction postprocess(Ballot ballot, const VotePostprocessing& postprocessing,
                       std::span<const double> features);

// Postprocessing as lines of a stored model.

/// Writes one section. An absent postprocessing is "aids 0", one without profile and reject rule
/// "aids 2".
void write_postprocessing(LineWriter& out, const std::optional<VotePostprocessing>& postprocessing);

/// Reads the section, bit for bit; problems are recorded in `in`. Sizes must fit the model's.
/// `sigmoids` is the number of cores, 0 for a learner without cores.
std::optional<VotePostprocessing> read_postprocessing(LineReader& in, std::size_t classes,
                                                      std::size_t features, std::size_t sigmoids);

// Prediction for one trial with any learner.

/// Postprocessing of any learner, fitted to its own training rows. `options` are those of the
/// training, `cap` that of the recipe. Cores: like fit_postprocessing() of the model, on compressed
/// features if they use those. The scaling before the compression is then that of all training
/// rows, so held-out rows affect it (mean and deviation only, not their labels). LDA, SVC and trees
/// are trained again on class_folds() with their parameters. Their scores of held-out rows are
/// sharpened to the likeliest probabilities: softmax of the LDA's discriminants, of the SVC's sums
/// of tanh(f), of ln of the trees' shares. Empty without such folds, as a probability would come
/// from the fit of the training rows. Refuses what fit_postprocessing() refuses.
Result<std::optional<VotePostprocessing>> fit_postprocessing(const TrainedLearner& learner,
                                                             const FeatureMatrix& matrix,
                                                             const TrainOptions& options,
                                                             double false_reject = 0.05);

/// Without `postprocessing` there is no probability and nothing is refused. Kinds of vote are for
/// cores. Another learner refuses all but VoteKind::majority, and has no votes (LDA, trees) or its
/// own (SVC). Refuses what predict() of the cores refuses.
Result<Prediction> predict(const TrainedLearner& learner,
                           const std::optional<VotePostprocessing>& postprocessing,
                           std::span<const double> features, const VoteOptions& options = {});

/// predict() of every row, with Ballot::decision empty: for 500 classes it takes a megabyte. All
/// cores decide a block of rows at a time; with many classes this is several times as fast as row
/// by row. One result per row; a trial with an error does not stop the others.
std::vector<Result<Prediction>> predict_all(const TrainedLearner& learner,
                                            const std::optional<VotePostprocessing>& postprocessing,
                                            const Matrix& rows, const VoteOptions& options = {},
                                            std::size_t threads = 0);

}  // namespace weft::classifier
