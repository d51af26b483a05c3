#pragma once
// A rig file with what is read from it, as every command begins that works on a rig.

#include <filesystem>

#include "daemon/hardware/rig/rig_file.hpp"
#include "recipes/engine/rig_limits.hpp"

namespace weft::daemon {

struct OpenedRig {
  RigFile file;               ///< its drivers also from plugins
  recipes::RigLimits limits;  ///< that the file sets
};

/// Errors: those of read_text_file(), recipes::parse_rig_limits() and parse_rig_file(), with the
/// file's name.
Result<OpenedRig> open_rig(const std::filesystem::path& path, const PluginSettings& plugins);

}  // namespace weft::daemon
