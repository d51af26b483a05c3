#pragma once
// Whether a campaign file is read with all that was recorded: SQLite says nothing of a log that is
// missing or damaged, and gives what lies before.

#include <filesystem>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Errors: io; corrupt, at a byte of the log or with the log that is missing, and what to do.
Status check_wal(const std::filesystem::path& campaign);

}  // namespace weft::daemon
