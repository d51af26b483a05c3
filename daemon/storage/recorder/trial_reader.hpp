#pragma once
// Some attempts of a campaign file, for who looks at one trial after the other.

#include <cstddef>
#include <filesystem>
#include <string>

#include "daemon/base/file/read_file.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "daemon/storage/recorder/chunk.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Which attempts at trials, complete or not, and what of them.
struct AttemptSelection {
  std::string name = {};                              ///< "0007-denim-M1-r03"; empty: every one
  std::size_t from = 0, most = std::size_t{1} << 40;  ///< of all, in the order of the plan
  bool has_samples = true;             ///< false: names, outcomes and losses, no sample
  Stream last_stream = Stream::sound;  ///< streams after it are not read
  StopRequested stop_requested = {};   ///< looked at before each trial; then wrong_state
};

/// As load_campaign(), also of a discarded campaign. Where they are not read, the phases and times
/// of the taxel frames are empty. Errors: load_campaign()'s.
Result<Dataset> load_attempts(const std::filesystem::path& path, const AttemptSelection& selection);

}  // namespace weft::daemon
