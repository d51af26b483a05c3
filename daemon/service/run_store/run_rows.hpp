#pragma once
// A run as a row of its table. For .cpp files of daemon/service/run_store.

#include "daemon/service/run_store/run_store.hpp"

namespace weft::daemon::runs {

/// `home`: the folder of the daemon's file, absolute; empty for a file in memory. Errors: io,
/// corrupt.
Result<std::vector<StoredRun>> read_runs(sqlite::Database& database,
                                         const std::filesystem::path& home);
/// A new row, or the columns of an old one that change during a run's life.
Status write_run(sqlite::Database& database, const std::filesystem::path& home,
                 const StoredRun& run);

}  // namespace weft::daemon::runs
