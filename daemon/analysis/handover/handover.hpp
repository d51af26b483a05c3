#pragma once
// Runs the handover of a complete campaign, as its recipe requests. It trains one model per
// exploration (none for sound and vibration) and evaluates it with models that have not seen the
// tested repetitions. Only data that agrees with the campaign's certificate is used. See
// daemon/analysis/handover/README.md.

#include <filesystem>
#include <functional>
#include <optional>
#include <vector>

#include "classifier/evaluate/evaluate.hpp"
#include "daemon/analysis/report/evaluate_campaign.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/storage/certificate/handover_file.hpp"
#include "recipes/engine/handover.hpp"

namespace weft::daemon {

/// Progress and stop of a handover. Each member may be empty.
struct HandoverHooks {
  EvaluationSink progress;
  StopRequested stop;  ///< called often, on several threads; when stopped, results so far are
                       ///< discarded
  classifier::SecondsNow seconds_now =
      {};                   ///< without it no time is measured, and the time limit does not apply
  std::size_t threads = 0;  ///< 0: one per core; models do not depend on it
  /// Makes further files of the handover from the data set, the results and the records so far
  /// (evaluation.json and those of pages). An error is recorded in evaluation.json and does not
  /// fail the handover. The recipe's time limit does not apply. The last argument is `stop`.
  std::function<Result<std::vector<HandoverText>>(const Dataset&, const HandoverResult&,
                                                  std::vector<HandoverText> records,
                                                  const StopRequested& stop)>
      report = {};
};

/// The handover settings in the recorded recipe of the campaign in `folder`, whatever the recipe's
/// file contains now; nothing if it has none. Errors: load_header()'s; an unusable recipe.
Result<std::optional<recipes::Handover>> load_handover_spec(const std::filesystem::path& folder);

/// Trains, evaluates and writes `folder`/handover, completely or not at all. An existing handover
/// that is intact and of this data set is returned unchanged; any other is set aside. Errors:
/// wrong_state if the campaign is not complete, or when stopped; busy if another process works in
/// the folder; timeout after the recipe's `at_most_s`; corrupt if the campaign disagrees with its
/// certificate; not_found if the recipe requests no handover; those of the classifier and of
/// writing files.
Result<HandoverResult> run_handover(const std::filesystem::path& folder,
                                    const HandoverHooks& hooks);

}  // namespace weft::daemon
