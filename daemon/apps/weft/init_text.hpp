#pragma once
// What `weft init` prints: the devices that were found, and the rig file that was written.

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
/// With a capital letter.
std::string sentence_case(std::string_view text);

/// All devices in a table, with what is to be known of each.
std::string format_found(const SearchReport& report);

/// Roles, what is assumed and the next commands. `recipe`: one that suits the rig; empty where none
/// does.
std::string format_init(const std::filesystem::path& rig, const std::string& recipe,
                        const RigDraft& draft);
/// "assumed" has the form of an answers file.
nlohmann::json init_json(const std::filesystem::path& rig, const std::string& recipe,
                         const RigDraft& draft, const SearchReport& report);

/// Says what keeps the devices from being a rig. Returns exit_failure.
int refuse_draft(const std::vector<Error>& missing, const SearchReport& report, Console& console);

}  // namespace weft::daemon::cli
