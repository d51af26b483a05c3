#pragma once
// Whether what was exported of a campaign is what its list says, and still of all that there is. A
// run that is gone on with leaves its exports as they are: they are of the trials of then.

#include <filesystem>
#include <string_view>

#include "daemon/storage/certificate/verify.hpp"

namespace weft::daemon {

std::string_view to_string(ExportState state);

/// How each export that is listed in `folder` stands to the campaign as it is now, without a look
/// at its bytes; empty where nothing was exported. Errors: listed_exports()'s, load_progress()'s.
Result<std::vector<CheckedExport>> exports_now(const std::filesystem::path& folder);

/// Adds the exports to `report`, their bytes looked at: an altered one is a finding. One that is
/// missing or outdated is none, for nothing that was recorded is.
void check_exports(const std::filesystem::path& folder, const StopRequested& stop_requested,
                   VerifyReport& report);

}  // namespace weft::daemon
