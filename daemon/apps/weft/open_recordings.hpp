#pragma once
// Recordings of sound and vibration, as commands are given them: a file of them, or a campaign.

#include <filesystem>
#include <string>

#include "daemon/storage/recordings/recording_set.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::cli {

/// A file of recordings, or those of a data set with a vibration sensor, of all its explorations.
Result<RecordingSet> open_all_recordings(const std::filesystem::path& path);
/// The same, but of the exploration that is meant, as find_exploration() tells; a file of
/// recordings has none, and refuses a name.
Result<RecordingSet> open_recordings(const std::filesystem::path& path,
                                     const std::string& exploration, bool one_exploration);

}  // namespace weft::daemon::cli
