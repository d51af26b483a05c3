#pragma once
// Files of a handover, beside the data set: handover/evaluation.json, and for each exploration a
// model (M1.model) and a page (M1.html). The first lists the others with their digests.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

// State of a run's handover, reported separately from outcome, clean-up and rig.

enum class HandoverState : std::uint8_t {
  none,       ///< the recipe requests none
  waiting,    ///< for the previous handover
  running,    ///< on a thread of low priority
  done,       ///< the folder handover/ is complete
  failed,     ///< `error` has the reason; the run itself is unaffected
  cancelled,  ///< by a person
};
std::string_view to_string(HandoverState state);
std::optional<HandoverState> handover_state_from(std::string_view word);
/// True if the state no longer changes by itself.
bool is_over(HandoverState state);

struct HandoverStatus {
  HandoverState state = HandoverState::none;
  std::string by;           ///< user of the last request or cancellation
  std::string error;        ///< a sentence
  std::string result_json;  ///< handover_result_json(), set when done
  /// Times it was begun and then interrupted by the end of the daemon, not by a user.
  std::size_t attempts = 0;
  // Progress while it runs; not kept over a restart.
  std::size_t step = 0, steps = 0;
  std::string what = {};  ///< "M1: features of 340 trials"
};

inline constexpr const char* handover_folder_name = "handover";
inline constexpr const char* evaluation_file_name = "evaluation.json";

/// A model and its accuracy.
struct HandoverModel {
  std::string exploration;
  std::string file;           ///< relative to the run's folder: "handover/M1.model"
  std::string sha256;         ///< digest of the file
  std::string learner;        ///< learner and view: "lda, ranks"
  std::size_t trained = 0;    ///< number of trials: all of the exploration
  std::size_t requested = 0;  ///< predictions in the evaluation, each by a model that has not seen
                              ///< the trial
  double accuracy = 0;        ///< mean over the groups that were left out
  double ci95_low = 0, ci95_high = 1;
  bool operator==(const HandoverModel&) const = default;
};

/// A share of correct predictions and its 95 % interval.
struct HandoverShare {
  double share = 0;
  double ci95_low = 0, ci95_high = 1;
  bool operator==(const HandoverShare&) const = default;
};

/// Evaluation of the sound and vibration of an exploration; no model is kept.
struct HandoverEvaluation {
  std::string exploration;
  std::string page;     ///< relative to the run's folder: "handover/V1.html"
  std::string learner;  ///< chosen without the test recordings: "LDA, RForest"
  double window_s = 0;
  std::size_t recordings = 0;  ///< slides, each tested once
  std::size_t materials = 0;   ///< chance is 1 / materials
  HandoverShare windows;       ///< accuracy of single windows
  HandoverShare slides;        ///< accuracy of slides, by majority vote of their windows
  bool operator==(const HandoverEvaluation&) const = default;
};

struct HandoverResult {
  std::string bench;  ///< "simulated", "real" or "unknown"
  std::string dataset_sha256;
  std::vector<HandoverModel> models;            ///< in the order of the explorations' first trials
  std::vector<HandoverEvaluation> evaluations;  ///< evaluations without a model, in the same order
  /// JSON list: the accuracy shown for each exploration, with its protocol; empty in older files.
  std::string results_json = {};
  bool operator==(const HandoverResult&) const = default;
};

/// One file of the handover.
struct HandoverText {
  std::string name;  ///< "M1.model"
  std::string text;
};

/// {exploration, model, sha256, learner, trained, asked, accuracy, ci95}.
nlohmann::ordered_json model_json(const HandoverModel& model);
/// {exploration, page, learner, window_s, recordings, materials, windows {accuracy, ci95}, slides}.
nlohmann::ordered_json evaluation_line_json(const HandoverEvaluation& evaluation);
/// {bench, dataset_sha256, models, evaluations} and, if known, results: the form sent to clients.
nlohmann::ordered_json handover_result_json(const HandoverResult& result);

/// Reads the content of evaluation.json. Throws nlohmann::json::exception if it is malformed.
HandoverResult handover_result_from(const nlohmann::ordered_json& evaluation);

/// Writes `folder`/handover with `texts` and evaluation.json, completely or not at all. An existing
/// handover is set aside. `evaluation` needs bench, dataset_sha256 and models, and may have
/// evaluations and results. The list of files and the evaluation's own digest are added. Errors:
/// io; range if a text exceeds 256 MiB, the limit of the reader.
Result<HandoverResult> write_handover(const std::filesystem::path& folder,
                                      nlohmann::ordered_json evaluation,
                                      const std::vector<HandoverText>& texts);

/// The files that the evaluation lists; they are not read. Empty without a handover. Errors: parse;
/// corrupt if the evaluation's own digest disagrees.
Result<std::vector<FileChecksums>> listed_handover_files(const std::filesystem::path& folder);

/// Nothing without a handover. Errors: parse; corrupt if the evaluation's own digest disagrees, or
/// a listed file is missing or altered.
Result<std::optional<HandoverResult>> read_handover(const std::filesystem::path& folder);

/// Adds the faults of the folder's handover to `report`: read_handover()'s errors, or a data set
/// other than `dataset_sha256` (empty: not known).
void check_handover(const std::filesystem::path& folder, const std::string& dataset_sha256,
                    VerifyReport& report);

}  // namespace weft::daemon
