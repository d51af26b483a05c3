#include "daemon/apps/weft/command_line.hpp"

#include <CLI/CLI.hpp>

#include "daemon/apps/weft/console.hpp"

namespace weft::daemon::cli {

std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv) {
  try {
    app.parse(argc, argv);
    return std::nullopt;
  } catch (const CLI::ParseError& e) {
    const int status = app.exit(e);
    return status == 0 ? exit_ok : exit_usage;
  }
}

}  // namespace weft::daemon::cli
