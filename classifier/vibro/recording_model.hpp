#pragma once
// A trained model of sound and vibration: the preparation of recordings as in the training, its
// training, and its predictions.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "classifier/learners/learner.hpp"
#include "classifier/model/model_file.hpp"
#include "classifier/vibro/extract.hpp"

namespace weft::classifier {

namespace vibro {

/// How a recording becomes rows of features.
struct RecordingSetup {
  std::vector<Channel> channels;
  FeatureChoice features;
  double window_s = 2.0;
  double step_s = 0.25;  ///< time between two windows
};

}  // namespace vibro

template <>
struct SetupText<vibro::RecordingSetup> {
  static constexpr Modality modality = Modality::vibro;
  static void write(LineWriter& out, const vibro::RecordingSetup& setup);
  static vibro::RecordingSetup read(LineReader& in);
  static Result<std::vector<std::string>> feature_names(const vibro::RecordingSetup& setup,
                                                        std::size_t most);
  /// Lines of "weft-recording-model 1" in place of learner, view and labels.
  static std::optional<ModelParts> read_pipeline(LineReader& in,
                                                 const std::vector<std::string>& names);
};

namespace vibro {

using RecordingModel = Model<RecordingSetup>;

/// Digest of rates and samples, not of name, label or time.
std::uint64_t content_digest(const Recording& recording);

/// Recordings that train_recording_model() leaves out.
std::vector<TooShort> too_short_for(const RecordingSetup& setup,
                                    std::span<const Recording> recordings);

/// Result of `best` on recordings: the learner and its features.
struct ChosenRecipe {
  Recipe recipe;  ///< on all columns of `features`
  FeatureChoice features;
  std::vector<RecipeScore> scores;  ///< of all candidates; none tested if that is impossible
};
/// train_best() of window_candidates() on the windows of `setup`. With `features_are_named` it uses
/// the features of `setup`. Refuses what cut_and_extract() and train_best() refuse.
Result<ChosenRecipe> choose_recipe(std::span<const Recording> recordings,
                                   const RecordingSetup& setup, bool features_are_named,
                                   std::size_t components, const TrainOptions& options);

/// Cuts, extracts, trains and calibrates (calibrate_recordings()). Recordings shorter than a window
/// are left out. Refuses a label with only such recordings, and what cut_and_extract() and
/// train_recipe() refuse.
Result<RecordingModel> train_recording_model(std::span<const Recording> recordings,
                                             const RecordingSetup& setup, const Recipe& recipe,
                                             const TrainOptions& options, Provenance provenance);

/// Reason why such a model would give no probability; empty if it gives one. See
/// reason_without_probability() of windows.
std::string reason_without_probability(std::span<const Recording> recordings,
                                       const RecordingSetup& setup, const Recipe& recipe,
                                       const TrainOptions& options);

/// Prediction for a recording: the most frequent label of its windows; the first one wins a tie.
struct RecordingAnswer {
  std::string file;
  std::string true_label;            ///< empty: unknown
  std::size_t label = 0;             ///< index into the labels of the learner
  std::vector<std::size_t> windows;  ///< per label: windows predicted as it
  std::vector<double> probability;   ///< per label; empty if the model is not calibrated
};
/// One per recording. Refuses other channels than in the training (same_sensor()), and a recording
/// shorter than a window.
Result<std::vector<RecordingAnswer>> classify_recordings(const RecordingModel& model,
                                                         std::span<const Recording> recordings);

}  // namespace vibro
}  // namespace weft::classifier
