#pragma once
// Writes a draft as a rig file.

#include <filesystem>
#include <string>

#include "daemon/campaign/setup/rig_draft.hpp"

namespace weft::daemon {

/// The rig file of a draft without missing_parts(). For a simulated or emulated bench the tables of
/// the simulation have absolute paths, so that the file can be anywhere. Errors: not_found if those
/// tables are neither in the working folder nor installed.
Result<std::string> rig_text(const RigDraft& draft);

/// Writes the rig file if it passes the checks of `weft check` for a rig without a recipe. Errors:
/// wrong_state if `target` exists, which is never overwritten; those of rig_text(),
/// check_rig_file(), and io.
Status write_rig(const RigDraft& draft, const std::filesystem::path& target);

/// Errors: wrong_state if it exists. Call it before a search, which takes a while.
Status require_new_file(const std::filesystem::path& target);

/// A recipe of the library that `weft check` accepts for the rig file of a draft, preferably a
/// short one; empty if it accepts none.
std::string suitable_recipe(const RigDraft& draft, const std::filesystem::path& rig);

// Shapes of simulated rigs.

struct RigShape {
  std::string_view name, text;
};
std::span<const RigShape> rig_shapes();
/// A draft of that shape. Errors: not_found, with the existing shapes.
Result<RigDraft> simulated_draft(std::string_view shape);

}  // namespace weft::daemon
