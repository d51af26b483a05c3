#pragma once
// The file of a trained model of any modality: text, versioned, self-describing, with a checksum as
// its last line. The head has its own checksum. It has the kind of the model, its provenance and
// the setup that turns a recording into rows of features. The body has the trained parts.
//
//   weft-model 1
//   modality fabric|vibro|imprint
//   stages N             0: of whole recordings; else frames and sample rate of a live model
//   provenance, setup    of the modality
//   head_crc32 ...
//   trained_on N         and the digests of the training recordings
//   learner, view, labels, features, trained parameters, postprocessing (a live model: per stage)
//   crc32 ...
//
// Older files are read too: "weft-fabric-model" 3 to 6, "weft-recording-model" 1 and 2,
// "weft-imprint-model" 1, and "weft-live-model" 2 by classifier/live.

#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/fabric/model_text.hpp"
#include "classifier/learners/learner.hpp"
#include "classifier/learners/learner_text.hpp"
#include "classifier/vote/postprocessing.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// The modality of the recordings; it determines how they become rows of features.
enum class Modality {
  fabric,  ///< strokes of a taxel array
  vibro,   ///< sound and vibration
  imprint  ///< presses on an imprint array
};
std::string_view to_string(Modality modality);

/// The trained parts of a model, whatever its features.
struct ModelParts {
  TrainedLearner learner;
  std::optional<VotePostprocessing> postprocessing;
};

/// `Setup`: how a recording becomes the rows of features for the learner.
template <class Setup>
struct Model {
  TrainedLearner learner;
  Setup setup;
  Provenance provenance;
  std::optional<VotePostprocessing> postprocessing =
      {};  ///< absent: no probability, no short-list, no unknown fabrics
  /// ContentDigest of each training recording, as used for the features; empty: unknown.
  std::vector<std::uint64_t> trained_on = {};
};

/// Specialised for each setup. Members: `modality`; `write(LineWriter&, const Setup&)` and
/// `read(LineReader&)`, bit for bit; `feature_names(const Setup&, most)`. The last one returns a
/// Result; it may be an error if there would be more than `most` names, as the file has no lines
/// for more.
template <class Setup>
struct SetupText;

/// First line of every file.
inline constexpr std::string_view model_file_header = "weft-model 1";

/// Kind of model in a file, from its first lines.
struct ModelKind {
  Modality modality = Modality::fabric;
  bool is_live = false;  ///< for live votes
};
/// Errors: parse (not a model file), unsupported (another version), corrupt.
Result<ModelKind> find_model_kind(std::string_view beginning);

/// Refuses a model with other features than those of its setup. Errors: io if the stream fails.
template <class Setup>
Status save_model(const Model<Setup>& model, std::ostream& out);

/// Loads the same model, bit for bit. Errors: parse (not a model file, or another modality),
/// unsupported (another version, a live model), corrupt (incomplete or altered; with the line if
/// known).
template <class Setup>
Result<Model<Setup>> load_model(std::istream& in);

// Shared by readers and writers of models.

/// Lines that only the head of a live model has.
struct StageLines {
  std::vector<std::size_t> motion_frames;  ///< per stage; empty: not a live model
  double sample_rate_hz = 0;
};
StageLines read_stages(LineReader& in);

/// `setup`: lines of the setup; `body`: lines of write_parts(), stage by stage.
Status write_model_file(ModelKind kind, const StageLines& stages, const Provenance& provenance,
                        std::string_view setup, std::span<const std::uint64_t> trained_on,
                        std::string_view body, std::ostream& out);
void write_parts(LineWriter& out, const TrainedLearner& learner,
                 const std::optional<VotePostprocessing>& postprocessing);

/// The lines of a model file with a correct checksum, after those of its kind.
struct ModelLines {
  LineReader in;
  ModelKind kind;
  int learner_version = 6;  ///< version for read_head()
  bool is_today = true;  ///< true: current version; an older file has no stages, no checksum of the
                         ///< head, no digests
  bool has_pipeline = false;  ///< "weft-recording-model 1": its learner has another text form

  /// Checks and removes the checksum of the head; then reads the digests.
  std::vector<std::uint64_t> read_trained_on();
};
/// `text` must outlive the result. Errors: those of load_model(), `expected` for another kind.
Result<ModelLines> open_model_file(std::string_view text, ModelKind expected);
Result<std::string> read_model_text(std::istream& in);

/// Opens the beginning of a current file, which may be incomplete. Returns its lines up to the
/// checksum of the head, which is checked.
Result<ModelLines> open_model_head(std::string_view beginning, ModelKind expected);

/// Reads the lines of write_parts(). Problems are recorded in `in`; the result is then empty.
/// Refuses features with other names than `expected`.
std::optional<ModelParts> read_parts(LineReader& in, int learner_version,
                                     const Result<std::vector<std::string>>& expected);
/// The same after head and labels were read.
std::optional<ModelParts> read_parts(LineReader& in, const LearnerHead& head,
                                     std::vector<std::string> labels,
                                     const std::vector<std::string>& expected);

/// Errors: invalid_argument if the names are not those of the setup.
Status check_feature_names(const TrainedLearner& learner,
                           const Result<std::vector<std::string>>& expected);

template <class Setup>
Status save_model(const Model<Setup>& model, std::ostream& out) {
  using Text = SetupText<Setup>;
  const std::size_t columns = model.learner.feature_names().size();
  const auto names = Text::feature_names(model.setup, columns);
  if (auto ok = check_feature_names(model.learner, names); !ok) return ok;
  LineWriter setup, body;
  Text::write(setup, model.setup);
  write_parts(body, model.learner, model.postprocessing);
  return write_model_file({Text::modality, false}, {}, model.provenance, setup.str(),
                          model.trained_on, body.str(), out);
}

template <class Setup>
Result<Model<Setup>> load_model(std::istream& stream) {
  using Text = SetupText<Setup>;
  const Result<std::string> text = read_model_text(stream);
  if (!text) return pass(text.error());
  Result<ModelLines> lines = open_model_file(*text, {Text::modality, false});
  if (!lines) return pass(lines.error());
  LineReader& in = lines->in;
  Provenance provenance = read_provenance(in);
  Setup setup = Text::read(in);
  std::vector<std::uint64_t> trained_on = lines->read_trained_on();
  std::optional<ModelParts> parts;
  if (in.ok()) {
    const Result<std::vector<std::string>> names = Text::feature_names(setup, in.left());
    if constexpr (requires { Text::read_pipeline(in, *names); }) {
      parts = lines->has_pipeline && names ? Text::read_pipeline(in, *names)
                                           : read_parts(in, lines->learner_version, names);
    } else {
      parts = read_parts(in, lines->learner_version, names);
    }
  }
  in.finish();
  if (!in.ok() || !parts) return pass(in.status().error());
  return Model<Setup>{std::move(parts->learner), std::move(setup), std::move(provenance),
                      std::move(parts->postprocessing), std::move(trained_on)};
}

}  // namespace weft::classifier
