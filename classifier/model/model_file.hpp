#pragma once
// A trained model as a file: text, versioned, self-describing, closed by a checksum. It carries
// what is needed to prepare a trial as the training trials were, and where those came from.

#include <cstddef>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/fabric/model_text.hpp"
#include "classifier/features/feature_matrix.hpp"
#include "classifier/learners/learner.hpp"
#include "classifier/learners/learner_text.hpp"
#include "classifier/vote/postprocessing.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

// What was learnt, whatever the features are of, as lines of a stored model: learner, labels, names
// of the features, vote aids.

struct ModelParts {
  TrainedLearner learner;
  std::optional<VotePostprocessing> postprocessing;
};

void write_model_parts(LineWriter& out, const TrainedLearner& learner,
                       const std::optional<VotePostprocessing>& postprocessing);

/// What follows head and labels, bit for bit. Refuses features of other names than `expected`.
/// `in` keeps the first problem; nothing then.
std::optional<ModelParts> read_model_parts(LineReader& in, const LearnerHead& head,
                                           std::vector<std::string> labels,
                                           const std::vector<std::string>& expected);

/// How a trial became the feature vector that the model takes.
struct FeatureSetup {
  std::size_t taxels = 0;
  PhaseSet phases;
  FeatureOptions options;
  double window_s = 0.0;         ///< phase M was cut into windows; 0: whole strokes
  double window_step_s = 0.0;    ///< 0: windows do not overlap
  double sample_period_s = 0.0;  ///< of the training trials; needed for windows, 0 when not known
  std::string exploration;       ///< of the training trials, such as "M1"; empty when not known
};

struct StoredModel {
  TrainedLearner learner;
  FeatureSetup setup;
  Provenance provenance;
  std::optional<VotePostprocessing> postprocessing =
      {};  ///< absent: no probability, no short-list, nothing refused
};

/// First line of every file.
/// Still read are versions 5 to 3, see read_head().
inline constexpr const char* model_file_header = "weft-fabric-model 6";

/// Refuses a model whose features are not those of `setup`; Errc::io when the stream fails.
Status save_model(const StoredModel& stored, std::ostream& out);

/// The same model, bit for bit. Errors: parse (not a model file), unsupported (another version),
/// corrupt (cut short or altered; names the line where that is known).
Result<StoredModel> load_model(std::istream& in);

/// What the first lines of a model file say, before anything that was learnt.
struct ModelHead {
  Provenance provenance;
  FeatureSetup setup;
};
/// Of the beginning of a model file, which need not be whole: no checksum is looked at. Errors:
/// parse, unsupported, corrupt.
Result<ModelHead> load_model_head(std::string_view beginning);

/// Refuses a trial, already cut into windows where the model wants them, with other taxels or
/// phases than the training had.
Status check_trial(const FeatureSetup& setup, const Trial& trial);

/// The answers on such trials, without Ballot::decision. Refuses, by name, a trial that
/// check_trial() refuses, or whose features or answer cannot be had.
Result<std::vector<Prediction>> classify(const StoredModel& stored, std::span<const Trial> trials,
                                         const VoteOptions& options = {}, std::size_t threads = 0);

}  // namespace weft::classifier
