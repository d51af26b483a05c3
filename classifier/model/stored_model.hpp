#pragma once
// A trained model of strokes: the preparation of a trial as in the training, and predictions.

#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/features/feature_matrix.hpp"
#include "classifier/model/model_file.hpp"

namespace weft::classifier {

/// How a trial becomes the feature vector for the model.
struct FeatureSetup {
  std::size_t taxels = 0;
  PhaseSet phases;
  FeatureOptions options;
  double window_s = 0.0;         ///< phase M is cut into windows of this length; 0: whole strokes
  double window_step_s = 0.0;    ///< 0: windows do not overlap
  double sample_period_s = 0.0;  ///< of the training trials; needed for windows, 0 if unknown
  std::string exploration;       ///< of the training trials, such as "M1"; empty if unknown
};

template <>
struct SetupText<FeatureSetup> {
  static constexpr Modality modality = Modality::fabric;
  static void write(LineWriter& out, const FeatureSetup& setup);
  static FeatureSetup read(LineReader& in);
  static Result<std::vector<std::string>> feature_names(const FeatureSetup& setup,
                                                        std::size_t most);
};

using StoredModel = Model<FeatureSetup>;

/// Digest of the data that the features come from: samples and phases, but not name, label or time.
std::uint64_t content_digest(const Trial& trial);
std::vector<std::uint64_t> content_digests(std::span<const Trial> trials);

/// Refuses a trial with other taxels or phases than in the training. The trial must already be cut
/// into windows if the model needs them.
Status check_trial(const FeatureSetup& setup, const Trial& trial);

/// Blocks of features that the predictions depend on: those of the learner's columns. With
/// postprocessing all blocks, as its open-set rule measures distances in every column.
BlockSet used_blocks(const StoredModel& stored);

/// Predictions for such trials, without Ballot::decision. Refuses, with its name, a trial that
/// check_trial() refuses, or one without usable features or prediction.
Result<std::vector<Prediction>> classify(const StoredModel& stored, std::span<const Trial> trials,
                                         const VoteOptions& options = {}, std::size_t threads = 0);

}  // namespace weft::classifier
