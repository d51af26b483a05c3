#pragma once
// What a hand-over leaves beside the data set: handover/evaluation.json, and for each exploration a
// model (M1.model) and a page (M1.html), which the first lists with their digests.

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

// What became of a run's hand-over: a fact of its own, beside outcome, cleanup and rig.

enum class HandoverState : std::uint8_t {
  none,       ///< the recipe wants none
  waiting,    ///< for the one before it
  running,    ///< on a thread of low priority
  done,       ///< handover/ is there
  failed,     ///< `error` says why; the run is what it is
  cancelled,  ///< by a person
};
std::string_view to_string(HandoverState state);
std::optional<HandoverState> handover_state_from(std::string_view word);
/// Nothing more comes of it by itself.
bool is_over(HandoverState state);

struct HandoverStatus {
  HandoverState state = HandoverState::none;
  std::string by;           ///< who asked for it last, or ended it
  std::string error;        ///< a sentence
  std::string result_json;  ///< handover_result_json(), once it is done
  /// So often it was begun and the daemon ended under it, not by anybody's wish.
  std::size_t attempts = 0;
  // While it runs; nothing of this is kept over a restart.
  std::size_t step = 0, steps = 0;
  std::string what = {};  ///< "M1: features of 340 trials"
};

inline constexpr const char* handover_folder_name = "handover";
inline constexpr const char* evaluation_file_name = "evaluation.json";

/// A model and what it is worth.
struct HandoverModel {
  std::string exploration;
  std::string file;           ///< from the run's folder: "handover/M1.model"
  std::string sha256;         ///< of the file
  std::string learner;        ///< what was trained, in words: "lda, ranks"
  std::size_t trained = 0;    ///< trials, every one of the exploration
  std::size_t requested = 0;  ///< answers of the evaluation, each of a model without it
  double accuracy = 0;        ///< mean over the groups left out
  double ci95_low = 0, ci95_high = 1;
  bool operator==(const HandoverModel&) const = default;
};

/// A share of right answers and its 95 % interval.
struct HandoverShare {
  double share = 0;
  double ci95_low = 0, ci95_high = 1;
  bool operator==(const HandoverShare&) const = default;
};

/// What sound and vibration of an exploration tell; no model is kept.
struct HandoverEvaluation {
  std::string exploration;
  std::string page;     ///< from the run's folder: "handover/V1.html"
  std::string learner;  ///< chosen without what it was asked about: "LDA, RForest"
  double window_s = 0;
  std::size_t recordings = 0;  ///< slides, each asked about once
  std::size_t materials = 0;   ///< chance is one over it
  HandoverShare windows;       ///< of single windows
  HandoverShare slides;        ///< of slides, by the most frequent answer of their windows
  bool operator==(const HandoverEvaluation&) const = default;
};

struct HandoverResult {
  std::string bench;  ///< "simulated", "real" or "unknown"
  std::string dataset_sha256;
  std::vector<HandoverModel> models;            ///< in the order of the explorations' first trials
  std::vector<HandoverEvaluation> evaluations;  ///< without a model, likewise
  /// A list: of each exploration the accuracy that is shown, with its protocol; empty in older
  /// files.
  std::string results_json = {};
  bool operator==(const HandoverResult&) const = default;
};

/// A file of the hand-over.
struct HandoverText {
  std::string name;  ///< "M1.model"
  std::string text;
};

/// {exploration, model, sha256, learner, trained, asked, accuracy, ci95}.
nlohmann::ordered_json model_json(const HandoverModel& model);
/// {exploration, page, learner, window_s, recordings, materials, windows {accuracy, ci95}, slides}.
nlohmann::ordered_json evaluation_line_json(const HandoverEvaluation& evaluation);
/// {bench, dataset_sha256, models, evaluations} and, where they are known, results, as clients are
/// told.
nlohmann::ordered_json handover_result_json(const HandoverResult& result);

/// Of evaluation.json. Throws nlohmann::json::exception where it is not one.
HandoverResult handover_result_from(const nlohmann::ordered_json& evaluation);

/// Writes `folder`/handover with `texts` and evaluation.json, whole or not at all; one that is
/// there is set aside. `evaluation` needs bench, dataset_sha256 and models, and may have
/// evaluations and results; the list of files and a digest of its own are added. Errors: io; range,
/// where a text is larger than the 256 MiB that are read again.
Result<HandoverResult> write_handover(const std::filesystem::path& folder,
                                      nlohmann::ordered_json evaluation,
                                      const std::vector<HandoverText>& texts);

/// What the evaluation lists, without a look at the files; empty where there is no hand-over.
/// Errors: parse; corrupt, when the evaluation's own digest disagrees.
Result<std::vector<FileChecksums>> listed_handover_files(const std::filesystem::path& folder);

/// Nothing when there is none. Errors: parse; corrupt, when the evaluation's own digest disagrees
/// or a file that it lists is missing or altered.
Result<std::optional<HandoverResult>> read_handover(const std::filesystem::path& folder);

/// Adds to `report` what is wrong with the hand-over of the folder, where there is one:
/// read_handover()'s errors, or a data set that is not `dataset_sha256` (empty: not known).
void check_handover(const std::filesystem::path& folder, const std::string& dataset_sha256,
                    VerifyReport& report);

}  // namespace weft::daemon
