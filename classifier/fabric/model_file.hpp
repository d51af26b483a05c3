#pragma once
// A trained model as a file: text, versioned, self-describing, closed by a checksum. It carries
// what is needed to prepare a trial as the training trials were, and where those came from.

#include <cstddef>
#include <iosfwd>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/fabric/model.hpp"
#include "classifier/features/extract.hpp"
#include "classifier/vote/aids.hpp"
#include "protocols/base/result.hpp"

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

/// Where a model comes from.
struct Provenance {
  std::string bench = "unknown";  ///< "simulated", "real" or "unknown"
  std::string dataset_sha256;
  std::string software_version;
  std::string training;  ///< options of the training, for people
};

struct StoredModel {
  FabricModel model;
  FeatureSetup setup;
  Provenance provenance;
  std::optional<VoteAids> aids = {};  ///< absent: no probability, no short-list, nothing refused
};

/// First line of every file.
inline constexpr const char* model_file_header = "weft-fabric-model 3";

/// Refuses a model whose features are not those of `setup`; Errc::io when the stream fails.
Status save_model(const StoredModel& stored, std::ostream& out);

/// The same model, bit for bit. Errors: parse (not a model file), unsupported (another version),
/// corrupt (cut short or altered; names the line where that is known).
Result<StoredModel> load_model(std::istream& in);

/// One core as the lines that a model file holds of it, and back, bit for bit: for cores that
/// travel between processes. Errors: corrupt.
std::string core_text(const FabricCore& core);
Result<FabricCore> core_from_text(std::string_view text, std::size_t features);

/// Refuses a trial, already cut into windows where the model wants them, with other taxels or
/// phases than the training had.
Status check_trial(const FeatureSetup& setup, const Trial& trial);

/// Features and votes of one such trial.
Result<Vote> classify(const StoredModel& stored, const Trial& trial);

}  // namespace weft::classifier
