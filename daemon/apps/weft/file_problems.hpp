#pragma once
// Problems of files, as a command tells them.

#include "daemon/apps/weft/console.hpp"
#include "daemon/campaign/bench_check.hpp"

namespace weft::daemon::cli {

/// {"pointer", "message", "expected", "got", "hint", "sentence"}
nlohmann::json diagnostic_json(const recipes::Diagnostic& diagnostic);

/// Every problem under the name of its file; with --json also in the error object. Returns
/// exit_failure.
int refuse(const std::vector<FileProblem>& problems, Console& console);

}  // namespace weft::daemon::cli
