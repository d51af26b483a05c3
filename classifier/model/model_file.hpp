#pragma once
// A trained model as a file, of whatever modality: text, versioned, self-describing, closed by a
// checksum. A head, with a checksum of its own, says what the model is of, where it comes from and
// how a recording becomes rows of features; the body holds what was learnt.
//
//   weft-model 1
//   modality fabric|vibro|imprint
//   stages N             0: of whole recordings; else frames and sample rate of a live model
//   provenance, setup    of the modality
//   head_crc32 ...
//   trained_on N         and the digests of the training recordings
//   learner, view, labels, features, what was learnt, postprocessing; of a live model stage by
//   stage crc32 ...
//
// Older files are read: "weft-fabric-model" 3 to 6, "weft-recording-model" 1 and 2,
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

/// What is explored, and so how recordings become rows of features.
enum class Modality {
  fabric,  ///< strokes and slides of a taxel array
  vibro,   ///< sound and vibration
  imprint  ///< standing imprints
};
std::string_view to_string(Modality modality);

/// What was learnt, whatever the features are of.
struct ModelParts {
  TrainedLearner learner;
  std::optional<VotePostprocessing> postprocessing;
};

/// `Setup`: how a recording becomes the rows of features that the learner takes.
template <class Setup>
struct Model {
  TrainedLearner learner;
  Setup setup;
  Provenance provenance;
  std::optional<VotePostprocessing> postprocessing =
      {};  ///< absent: no probability, no short-list, nothing refused
  /// ContentDigest of each training recording, as the features were taken from it; empty: not
  /// known.
  std::vector<std::uint64_t> trained_on = {};
};

/// Specialised for each setup: `modality`; `write(LineWriter&, const Setup&)` and
/// `read(LineReader&)`, bit for bit; `feature_names(const Setup&, most)`, a Result that may be an
/// error where there would be more than `most`, which a file then has no lines for.
template <class Setup>
struct SetupText;

/// First line of every file.
inline constexpr std::string_view model_file_header = "weft-model 1";

/// Which model a file holds, by its first lines.
struct ModelKind {
  Modality modality = Modality::fabric;
  bool is_live = false;  ///< for votes while a slide goes on
};
/// Errors: parse (not a model file), unsupported (another version), corrupt.
Result<ModelKind> find_model_kind(std::string_view beginning);

/// Refuses a model whose features are not those of its setup; Errc::io when the stream fails.
template <class Setup>
Status save_model(const Model<Setup>& model, std::ostream& out);

/// The same model, bit for bit. Errors: parse (not a model file, or one of another modality),
/// unsupported (another version, a live model), corrupt (cut short or altered; names the line where
/// that is known).
template <class Setup>
Result<Model<Setup>> load_model(std::istream& in);

// What readers and writers of models share.

/// The lines of a live model's head that others do not have.
struct StageLines {
  std::vector<std::size_t> motion_frames;  ///< of each stage; none: not a live model
  double sample_rate_hz = 0;
};
StageLines read_stages(LineReader& in);

/// `setup`: its lines; `body`: those of write_parts(), stage by stage.
Status write_model_file(ModelKind kind, const StageLines& stages, const Provenance& provenance,
                        std::string_view setup, std::span<const std::uint64_t> trained_on,
                        std::string_view body, std::ostream& out);
void write_parts(LineWriter& out, const TrainedLearner& learner,
                 const std::optional<VotePostprocessing>& postprocessing);

/// The lines of a model file whose checksum is in order, after those that say what kind it is.
struct ModelLines {
  LineReader in;
  ModelKind kind;
  int learner_version = 6;    ///< of read_head()
  bool is_today = true;       ///< an older file has no stages, no checksum of the head, no digests
  bool has_pipeline = false;  ///< "weft-recording-model 1": its learner is another text

  /// Takes the checksum of the head off; the digests follow.
  std::vector<std::uint64_t> read_trained_on();
};
/// `text` outlives what is returned. Errors: those of load_model(), `expected` another kind.
Result<ModelLines> open_model_file(std::string_view text, ModelKind expected);
Result<std::string> read_model_text(std::istream& in);

/// Of the beginning of a file of today, which need not be whole: its lines up to the checksum of
/// the head, which is looked at.
Result<ModelLines> open_model_head(std::string_view beginning, ModelKind expected);

/// What write_parts() wrote; `in` keeps the first problem, nothing then. Refuses features of other
/// names than `expected`.
std::optional<ModelParts> read_parts(LineReader& in, int learner_version,
                                     const Result<std::vector<std::string>>& expected);
/// The same after head and labels.
std::optional<ModelParts> read_parts(LineReader& in, const LearnerHead& head,
                                     std::vector<std::string> labels,
                                     const std::vector<std::string>& expected);

/// Errc::invalid_argument where the names are not those that the setup gives.
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
