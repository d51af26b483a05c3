#pragma once
// Reads selected attempts of a campaign file, for callers that process one trial after the other.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "daemon/base/file/read_file.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "daemon/storage/recorder/chunk.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Which attempts to read, complete or not, and how much of each.
struct AttemptSelection {
  std::string name = {};                              ///< "0007-denim-M1-r03"; empty: all
  std::size_t from = 0, most = std::size_t{1} << 40;  ///< range within all attempts, in plan order
  bool has_samples = true;                            ///< false: names, outcomes and losses only
  Stream last_stream = Stream::sound;                 ///< later streams are not read
  StopRequested stop_requested = {};  ///< checked before each trial; then wrong_state
};

/// Like load_campaign(), but also for a discarded campaign. If samples are not read, the phases and
/// times of the taxel frames are empty. Errors: load_campaign()'s.
Result<Dataset> load_attempts(const std::filesystem::path& path, const AttemptSelection& selection);

/// Receives one attempt; `info` is that of the file, without `ended_early`. An error ends the
/// reading.
using AttemptVisitor = std::function<Status(const DatasetInfo& info, TrialData attempt)>;
/// Which attempts are visited.
enum class Attempts { all, complete };
/// Like load_campaign(), but with only one attempt in memory at a time. Returns the info with
/// `ended_early`. Errors: load_campaign()'s, the visitor's.
Result<DatasetInfo> visit_attempts(const std::filesystem::path& path, Attempts which,
                                   const AttemptVisitor& visitor,
                                   const StopRequested& stop_requested = {});

}  // namespace weft::daemon
