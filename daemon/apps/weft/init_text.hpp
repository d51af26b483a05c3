#pragma once
// Output of `weft init`: the devices found, and the rig file written.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "daemon/apps/weft/console.hpp"
#include "daemon/campaign/setup/device_search.hpp"
#include "daemon/campaign/setup/rig_draft.hpp"

namespace weft::daemon::cli {

/// "KDC101 27000004 at /dev/ttyUSB0".
std::string format_device(const FoundDevice& found);
/// Starts with a capital letter.
std::string sentence_case(std::string_view text);

/// All devices in a table with their details.
std::string format_found(const SearchReport& report);

/// Roles, assumptions and the next commands. `recipe`: one that suits the rig; empty if none does.
std::string format_init(const std::filesystem::path& rig, const std::string& recipe,
                        const RigDraft& draft);
/// "assumed" has the form of an answers file.
nlohmann::json init_json(const std::filesystem::path& rig, const std::string& recipe,
                         const RigDraft& draft, const SearchReport& report);

/// Reports why the devices do not make a rig. Returns exit_failure.
int refuse_draft(const std::vector<Error>& missing, const SearchReport& report, Console& console);

}  // namespace weft::daemon::cli
