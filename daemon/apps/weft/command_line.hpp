#pragma once
// The command line of a program with options alone: weftd, weft-rig.

#include <optional>

namespace CLI {
class App;
}

namespace weft::daemon::cli {

/// The exit status when the command line itself ends the program: 0 after help, version or manual,
/// 2 for one that is not understood, with a sentence on standard error. Nothing: go on.
std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv);

}  // namespace weft::daemon::cli
