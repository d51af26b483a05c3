#pragma once
// A trained model of sound and vibration: what is needed to prepare recordings as those of the
// training were, its training, and its answers.

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
  double step_s = 0.25;  ///< from one window to the next
};

}  // namespace vibro

template <>
struct SetupText<vibro::RecordingSetup> {
  static constexpr Modality modality = Modality::vibro;
  static void write(LineWriter& out, const vibro::RecordingSetup& setup);
  static vibro::RecordingSetup read(LineReader& in);
  static Result<std::vector<std::string>> feature_names(const vibro::RecordingSetup& setup,
                                                        std::size_t most);
  /// What "weft-recording-model 1" has in the place of learner, view and labels.
  static std::optional<ModelParts> read_pipeline(LineReader& in,
                                                 const std::vector<std::string>& names);
};

namespace vibro {

using RecordingModel = Model<RecordingSetup>;

/// Of rates and samples, not of name, label or time.
std::uint64_t content_digest(const Recording& recording);

/// Recordings of which train_recording_model() learns nothing.
std::vector<TooShort> too_short_for(const RecordingSetup& setup,
                                    std::span<const Recording> recordings);

/// What `best` comes to on recordings: the learner, on the features that it takes.
struct ChosenRecipe {
  Recipe recipe;  ///< of all columns of `features`
  FeatureChoice features;
  std::vector<RecipeScore> scores;  ///< of all candidates; none tested where nothing can be
};
/// train_best() of window_candidates() on the windows that `setup` describes; the features are
/// those of `setup` where they are named. Refuses what cut_and_extract() and train_best() refuse.
Result<ChosenRecipe> choose_recipe(std::span<const Recording> recordings,
                                   const RecordingSetup& setup, bool features_are_named,
                                   std::size_t components, const TrainOptions& options);

/// Cuts, extracts, trains and calibrates (calibrate_recordings()). Recordings shorter than a window
/// are left out; a label that has no others is refused, and so is what cut_and_extract() and
/// train_recipe() refuse.
Result<RecordingModel> train_recording_model(std::span<const Recording> recordings,
                                             const RecordingSetup& setup, const Recipe& recipe,
                                             const TrainOptions& options, Provenance provenance);

/// Why a model trained so would give no probability; empty where it does. See
/// reason_without_probability() of windows.
std::string reason_without_probability(std::span<const Recording> recordings,
                                       const RecordingSetup& setup, const Recipe& recipe,
                                       const TrainOptions& options);

/// What a model says of a recording: the label that most of its windows have, the first of equals.
struct RecordingAnswer {
  std::string file;
  std::string true_label;            ///< empty: not known
  std::size_t label = 0;             ///< into the labels of the learner
  std::vector<std::size_t> windows;  ///< per label: windows that were answered so
  std::vector<double> probability;   ///< per label; empty where the model is not calibrated
};
/// One per recording. Refuses other channels than the training had, as same_sensor() tells, and a
/// recording shorter than a window.
Result<std::vector<RecordingAnswer>> classify_recordings(const RecordingModel& model,
                                                         std::span<const Recording> recordings);

}  // namespace vibro
}  // namespace weft::classifier
