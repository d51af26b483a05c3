#pragma once
// Functions shared by the commands of `weft sim`.

#include "daemon/apps/weft/commands.hpp"

namespace weft::daemon::cli {

void add_sim_strokes_command(const CommandGroup& sim);

}  // namespace weft::daemon::cli
