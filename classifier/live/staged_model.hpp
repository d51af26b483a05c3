#pragma once
// A model for votes while a slide goes on, its file, the voter that evaluates it as frames come,
// and the rule for when a vote is sure. There is one trained machine for each of several lengths of
// slide: what a feature is worth changes with the length of the motion it is computed from, so one
// machine for all lengths knows each of them less well (classifier/README.md, "While the slide goes
// on").

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

/// Asked when so many frames of phase M have come.
struct LiveStage {
  std::size_t motion_frames = 0;
  StoredModel model;  ///< of S, P and the beginning of M; never of E, which comes after
};

struct StagedModel {
  double sample_rate_hz = 0;
  std::vector<LiveStage> stages;  ///< at least one; by rising length; one sensor, one set of labels
  std::vector<std::uint64_t> trained_on = {};  ///< of the slides, see Model

  [[nodiscard]] double slide_s(std::size_t stage) const;
  [[nodiscard]] const StoredModel& last() const { return stages.back().model; }
};

/// A sample rate read from times is right to so much: 50.00000000000001 Hz is 50 Hz.
inline constexpr double rate_rounding = 1e-9;

/// A live model has no more: FeatureStream keeps the tables of all their lengths.
inline constexpr std::size_t most_stages = 64;
static_assert(most_stages <= SpectrumCache::most);

/// 0.5, 1, 2, 3, 4, 6, 8, 12, 16, 24 ... up to `longest_s`: a vote at most 1.5 times later, from 2
/// s on, than it could have been. [s]
std::vector<double> stage_seconds(double longest_s);

/// The first `motion_frames` frames of phase M and what came before it, without phase E.
Trial begun_slide(const Trial& trial, std::size_t motion_frames);

struct StagedOptions {
  Learner learner = Learner::best;
  TrainOptions training;
  FeatureOptions features;
  std::string exploration;  ///< of all slides; empty when not known
  Provenance provenance;
};

/// A stage learns from the slides that are as long as it, aids included; there are as many stages
/// as have two such slides of every label, and as can say a probability where the first can (two
/// labels with three such slides, see fit_postprocessing()). Each is of the fewest frames that last
/// as long as stage_seconds() says: at 37 Hz the first has 19, 0.514 s. Refuses a sample rate that
/// is not positive, what check_labels() refuses, slides of which none is half a second long, and
/// what training refuses.
Result<StagedModel> train_staged(std::span<const Trial> slides, double sample_rate_hz,
                                 const StagedOptions& options);

/// A model file with stages. Errc::io when the stream fails; what save_model() refuses.
Status save_staged(const StagedModel& model, std::ostream& out);
/// Errors: parse (not such a file), unsupported (another version), corrupt (cut short, altered,
/// stages that do not fit each other or the sample rate). "weft-live-model 2" is read too.
Result<StagedModel> load_staged(std::istream& in);

/// What a file says of itself in its first kilobytes.
struct StagedHead {
  double sample_rate_hz = 0;
  FeatureSetup setup;
  Provenance provenance;
};
/// Reads the beginning alone, whatever the size: its checksum is looked at, what was learnt is
/// neither read nor checked. Errors: parse, unsupported, corrupt.
Result<StagedHead> load_staged_head(std::istream& in);

// A vote while the slide goes on, and the rule that says when it is sure.

/// What the model says of a slide so far.
struct LivePrediction {
  double slide_s = 0;               ///< of phase M that it has seen, by the nominal sample rate
  std::size_t winner = 0;           ///< index into the learner's labels()
  std::vector<double> probability;  ///< per label; empty where the model has no aids
  bool none_of_these = false;       ///< nothing that it was trained on is like this
};

/// When a slide has told enough.
struct StopRule {
  double sure_probability = 0.95;  ///< of the winner
  double least_slide_s = 0;        ///< to rate_rounding
};

/// A vote without probability, and one for a stranger, is never sure.
bool is_sure(const StopRule& rule, const LivePrediction& answer);

/// Feeds frames to the streaming features and asks each stage of the model when its time has come.
/// A look costs one evaluation of Table I, its tables the first time, and one answer; all other
/// frames cost nanoseconds. Not for two threads at once.
class LiveVoter {
 public:
  /// `model` has a stage.
  explicit LiveVoter(std::shared_ptr<const StagedModel> model);

  /// A new trial.
  void restart();
  /// One frame, `counts` [taxels]. An answer where a look was due. Refuses what the features and
  /// the model refuse.
  Result<std::optional<LivePrediction>> add(Phase phase, std::span<const double> counts);

  [[nodiscard]] const StagedModel& model() const { return *model_; }

 private:
  [[nodiscard]] bool consumes(Phase phase) const;
  Result<LivePrediction> check();

  std::shared_ptr<const StagedModel> model_;
  std::vector<BlockSet> wanted_;  // of each stage
  FeatureStream stream_;
  std::size_t next_stage_ = 0;
};

}  // namespace weft::classifier
