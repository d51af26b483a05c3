#pragma once
// A draft as a rig file.

#include <filesystem>
#include <string>

#include "daemon/campaign/setup/rig_draft.hpp"

namespace weft::daemon {

/// The rig file of a draft without missing_parts(). A simulated or emulated one has the tables of
/// the simulation with their whole paths, so that the file may lie anywhere.
/// Errors: not_found, where those tables are neither in the working folder nor installed.
Result<std::string> rig_text(const RigDraft& draft);

/// Writes the rig file once all that `weft check` says of a rig without a recipe is well.
/// Errors: wrong_state, where `target` exists, which is never overwritten; those of rig_text(),
/// check_rig_file(), and io.
Status write_rig(const RigDraft& draft, const std::filesystem::path& target);

/// wrong_state where it exists: before a search, which takes a while.
Status require_new_file(const std::filesystem::path& target);

/// A recipe of the library that `weft check` accepts for the rig file of a draft, a short one where
/// there is one; empty where it accepts none.
std::string suitable_recipe(const RigDraft& draft, const std::filesystem::path& rig);

// Shapes of simulated rigs.

struct RigShape {
  std::string_view name, text;
};
std::span<const RigShape> rig_shapes();
/// A draft of that shape. Errors: not_found, with the shapes that there are.
Result<RigDraft> simulated_draft(std::string_view shape);

}  // namespace weft::daemon
