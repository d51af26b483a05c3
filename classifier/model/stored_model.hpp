#pragma once
// A trained model of strokes and slides: what is needed to prepare a trial as the training trials
// were, and the answers on such trials.

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

template <>
struct SetupText<FeatureSetup> {
  static constexpr Modality modality = Modality::fabric;
  static void write(LineWriter& out, const FeatureSetup& setup);
  static FeatureSetup read(LineReader& in);
  static Result<std::vector<std::string>> feature_names(const FeatureSetup& setup,
                                                        std::size_t most);
};

using StoredModel = Model<FeatureSetup>;

/// Of what the features of a trial are taken from: its samples and their phases, not its name,
/// label or time.
std::uint64_t content_digest(const Trial& trial);
std::vector<std::uint64_t> content_digests(std::span<const Trial> trials);

/// Refuses a trial, already cut into windows where the model wants them, with other taxels or
/// phases than the training had.
Status check_trial(const FeatureSetup& setup, const Trial& trial);

/// Blocks of features that the answers depend on: those of the columns that the learner uses; all
/// where there is postprocessing, whose open-set rule measures distances in every column.
BlockSet used_blocks(const StoredModel& stored);

/// The answers on such trials, without Ballot::decision. Refuses, by name, a trial that
/// check_trial() refuses, or whose features or answer cannot be had.
Result<std::vector<Prediction>> classify(const StoredModel& stored, std::span<const Trial> trials,
                                         const VoteOptions& options = {}, std::size_t threads = 0);

}  // namespace weft::classifier
