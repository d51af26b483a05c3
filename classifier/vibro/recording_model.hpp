#pragma once
// A trained learner as a file, with what is needed to prepare recordings as those of the training
// were: text, versioned, self-describing, closed by a checksum, like the model files of fabrics.

#include <cstddef>
#include <iosfwd>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/fabric/model_text.hpp"
#include "classifier/learners/learner.hpp"
#include "classifier/vibro/extract.hpp"

namespace weft::classifier::vibro {

/// How a recording becomes rows of features.
struct RecordingSetup {
  std::vector<Channel> channels;
  FeatureChoice features;
  double window_s = 2.0;
  double step_s = 0.25;  ///< from one window to the next
};

struct RecordingModel {
  Provenance provenance;
  RecordingSetup setup;
  TrainedLearner learner;
};

/// First line of every file; those of version 1 are read too.
inline constexpr std::string_view recording_model_header = "weft-recording-model 2";

/// Recordings of which train_recording_model() learns nothing.
std::vector<TooShort> too_short_for(const RecordingSetup& setup,
                                    std::span<const Recording> recordings);

/// What `best` comes to on recordings: the learner, on the features that it takes.
struct ChosenRecipe {
  Recipe recipe;  ///< of all columns of `features`
  FeatureChoice features;
};
/// train_best() of window_candidates() on the windows that `setup` describes; the features are
/// those of `setup` where they are named. Refuses what cut_and_extract() and train_best() refuse.
Result<ChosenRecipe> choose_recipe(std::span<const Recording> recordings,
                                   const RecordingSetup& setup, bool features_are_named,
                                   std::size_t components, const TrainOptions& options);

/// Cuts, extracts and trains. Recordings shorter than a window are left out; a label that has no
/// others is refused, and so is what cut_and_extract() and train_recipe() refuse.
Result<RecordingModel> train_recording_model(std::span<const Recording> recordings,
                                             const RecordingSetup& setup, const Recipe& recipe,
                                             const TrainOptions& options, Provenance provenance);

/// Errc::io when the stream fails.
Status save_recording_model(const RecordingModel& model, std::ostream& out);
/// The same answers, bit for bit. Errors: parse (not such a file), unsupported (another version),
/// corrupt (cut short or altered; names the line where that is known).
Result<RecordingModel> load_recording_model(std::istream& in);

/// What a model says of a recording: the label that most of its windows have, the first of equals.
struct RecordingAnswer {
  std::string file;
  std::string true_label;            ///< empty: not known
  std::size_t label = 0;             ///< into the labels of the learner
  std::vector<std::size_t> windows;  ///< per label: windows that were answered so
};
/// One per recording. Refuses other channels than the training had, as same_sensor() tells, and a
/// recording shorter than a window.
Result<std::vector<RecordingAnswer>> classify_recordings(const RecordingModel& model,
                                                         std::span<const Recording> recordings);

}  // namespace weft::classifier::vibro
