#pragma once
// What the commands of `weft sim` share.

#include "daemon/apps/weft/commands.hpp"

namespace weft::daemon::cli {

void add_sim_strokes_command(const CommandGroup& sim);

}  // namespace weft::daemon::cli
