#pragma once
// One shared object with a driver in it: found in order before anything in it is called.

#include <filesystem>
#include <string>

#include "daemon/hardware/plugins/plugin_driver.hpp"

namespace weft::daemon {

/// "weft-driver-NAME.so"
std::string plugin_file_name(std::string_view driver);
/// NAME of such a file name; empty when it is another one.
std::string load_driver(const std::filesystem::path& file);

/// Refuses a table that this program cannot call; reads version and size before all else.
/// Errors: unsupported, with what was expected and what the plugin has.
Status check_table(const weft_driver_entry_v1& table);

/// Loads the file and checks its table; its driver must be the one that the file's name says.
/// Errors: not_found, unsupported (no shared object, no driver in it, another ABI).
Result<LoadedPlugin> load_plugin(const std::filesystem::path& file);

}  // namespace weft::daemon
