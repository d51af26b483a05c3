#pragma once
// A model for live votes, its file, the voter that evaluates it as frames arrive, and the rule that
// ends the voting. The model has one trained learner for each of several lengths of stroke. The
// value of a feature changes with the length of its motion, so one learner for all lengths is less
// accurate at each (docs/explanation/learning.md, "Live votes").

#include <cstddef>
#include <iosfwd>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "classifier/features/feature_stream.hpp"
#include "classifier/features/layout.hpp"
#include "classifier/features/spectrum.hpp"
#include "classifier/features/trial.hpp"
#include "classifier/model/stored_model.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Used when `motion_frames` frames of phase M have arrived.
struct LiveStage {
  std::size_t motion_frames = 0;
  StoredModel model;  ///< trained on S, P and the beginning of M; never on E, which comes later
};

struct StagedModel {
  double sample_rate_hz = 0;
  std::vector<LiveStage>
      stages;  ///< at least one; by rising length; all with one sensor and one set of labels
  std::vector<std::uint64_t> trained_on = {};  ///< digests of the strokes, see Model

  [[nodiscard]] double slide_s(std::size_t stage) const;
  [[nodiscard]] const StoredModel& last() const { return stages.back().model; }
};

/// Relative error of a sample rate computed from times: 50.00000000000001 Hz is 50 Hz.
inline constexpr double rate_rounding = 1e-9;

/// Upper limit for a live model: FeatureStream keeps the tables of all stage lengths.
inline constexpr std::size_t most_stages = 64;
static_assert(most_stages <= SpectrumCache::most);

/// 0.5, 1, 2, 3, 4, 6, 8, 12, 16, 24 ... up to `longest_s` [s]. From 2 s on a vote comes at most
/// 1.5 times later than possible.
std::vector<double> stage_seconds(double longest_s);

/// The first `motion_frames` frames of phase M and the frames before them, without phase E.
Trial begun_slide(const Trial& trial, std::size_t motion_frames);

struct StagedOptions {
  Learner learner = Learner::best;
  TrainOptions training;
  FeatureOptions features;
  std::string exploration;  ///< of all strokes; empty if unknown
  Provenance provenance;
};

/// Trains each stage on the strokes that are at least as long, postprocessing included. A stage
/// needs two such strokes of every label. If the first stage has probabilities, later ones need
/// them too (two labels with three such strokes, see fit_postprocessing()). The length of a stage
/// is the fewest frames that last as long as stage_seconds(): at 37 Hz the first has 19, 0.514 s.
/// Refuses a sample rate that is not positive, what check_labels() refuses, strokes that are all
/// shorter than half a second, and what the training refuses.
Result<StagedModel> train_staged(std::span<const Trial> slides, double sample_rate_hz,
                                 const StagedOptions& options);

/// Writes a model file with stages. Errors: io if the stream fails; those of save_model().
Status save_staged(const StagedModel& model, std::ostream& out);
/// Errors: parse (not such a file), unsupported (another version), corrupt (incomplete, altered, or
/// stages that disagree with each other or the sample rate). Also reads "weft-live-model 2".
Result<StagedModel> load_staged(std::istream& in);

/// The head of a file, from its first kilobytes.
struct StagedHead {
  double sample_rate_hz = 0;
  FeatureSetup setup;
  Provenance provenance;
};
/// Reads only the head, whatever the size of the file, and checks its checksum. It neither reads
/// nor checks the trained parts. Errors: parse, unsupported, corrupt.
Result<StagedHead> load_staged_head(std::istream& in);

// A live vote, and the rule that decides when it is sure.

/// Prediction for a stroke so far.
struct LivePrediction {
  double slide_s = 0;               ///< duration of phase M so far, by the nominal sample rate
  std::size_t winner = 0;           ///< index into the learner's labels()
  std::vector<double> probability;  ///< per label; empty if the model has no postprocessing
  bool none_of_these = false;       ///< unknown fabric: nothing in the training resembles it
};

/// When a live vote is sure enough to stop.
struct StopRule {
  double sure_probability = 0.95;  ///< least probability of the winner
  double least_slide_s = 0;        ///< compared with the relative tolerance rate_rounding
};

/// False for a vote without probability and for an unknown fabric.
bool is_sure(const StopRule& rule, const LivePrediction& answer);

/// Feeds frames to the streaming features and predicts with each stage when it is due. A prediction
/// costs one evaluation of Table I (with new tables the first time) and one classification. All
/// other frames cost nanoseconds. Thread: one at a time.
class LiveVoter {
 public:
  /// `model` needs at least one stage.
  explicit LiveVoter(std::shared_ptr<const StagedModel> model);

  /// Begins a new trial.
  void restart();
  /// Adds one frame, `counts` [taxels]. Returns a prediction if a stage was due. Errors: those of
  /// the features and the model.
  Result<std::optional<LivePrediction>> add(Phase phase, std::span<const double> counts);

  [[nodiscard]] const StagedModel& model() const { return *model_; }

 private:
  [[nodiscard]] bool consumes(Phase phase) const;
  Result<LivePrediction> check();

  std::shared_ptr<const StagedModel> model_;
  std::vector<BlockSet> wanted_;  // per stage
  FeatureStream stream_;
  std::size_t next_stage_ = 0;
};

}  // namespace weft::classifier
