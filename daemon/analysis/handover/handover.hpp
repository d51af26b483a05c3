#pragma once
// A complete campaign goes to the classifier as its recipe says: a model of each exploration (none
// of sound and vibration), and an evaluation by models that never saw the repetitions they are
// asked about. Only what the
// campaign's certificate says was recorded takes part. See daemon/analysis/handover/README.md.

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

/// How a caller follows a hand-over and ends it. Each may be left empty.
struct HandoverHooks {
  EvaluationSink progress;
  StopRequested stop;  ///< asked often, on several threads; what was done so far is thrown away
  classifier::SecondsNow seconds_now =
      {};                   ///< without it no time is measured, and none is too long
  std::size_t threads = 0;  ///< 0: one per core; models do not depend on it
  /// Further files of the hand-over, of the data set, what was reached and the records so far
  /// (evaluation.json and those of pages). Its error is told in evaluation.json and costs nothing
  /// else; the recipe's time limit does not hold for it. The last argument is `stop`.
  std::function<Result<std::vector<HandoverText>>(const Dataset&, const HandoverResult&,
                                                  std::vector<HandoverText> records,
                                                  const StopRequested& stop)>
      report = {};
};

/// What the recipe of the campaign in `folder` says of it, as recorded, whatever has become of the
/// recipe's file since; nothing where it says nothing. Errors: load_header()'s, not a usable
/// recipe.
Result<std::optional<recipes::Handover>> load_handover_spec(const std::filesystem::path& folder);

/// Trains, evaluates and writes `folder`/handover, whole or not at all. One that is there, whole
/// and of this data set, is given back and nothing is done; another one is set aside.
/// Errors: wrong_state, when the campaign is not complete, another process works in the folder, or
/// it was stopped; timeout, past the recipe's `at_most_s`; corrupt, when the campaign is not what
/// its certificate says; not_found, when the recipe has none; the classifier's and the disk's.
Result<HandoverResult> run_handover(const std::filesystem::path& folder,
                                    const HandoverHooks& hooks);

}  // namespace weft::daemon
