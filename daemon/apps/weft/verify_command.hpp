#pragma once
// `weft verify`: whether a campaign or a data set is what was recorded.

#include <filesystem>

#include "daemon/apps/weft/console.hpp"

namespace CLI {
class App;
}

namespace weft::daemon::cli {

struct VerifyArgs {
  std::filesystem::path path;
};
void add_options(CLI::App& command, VerifyArgs& args);

/// exit_failure when something is not as it was recorded.
Result<int> run_verify(const VerifyArgs& args, Console& console);

}  // namespace weft::daemon::cli
