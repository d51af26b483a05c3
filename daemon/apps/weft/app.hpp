#pragma once
// The command line as a whole: parsing, dispatch, help and exit status.

#include "daemon/apps/weft/console.hpp"

namespace weft::daemon::cli {

/// Runs `weft` with these arguments. Never throws. Returns exit_ok, exit_failure or exit_usage.
int run(int argc, const char* const* argv, Console& console);

}  // namespace weft::daemon::cli
