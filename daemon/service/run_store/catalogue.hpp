#pragma once
// Runs as described by their folders. A lost or damaged catalogue (weftd.sqlite) is rebuilt from
// them, and a folder made by `weft run` can be added to it.

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/service/run_store/run_store.hpp"

namespace weft::daemon::runs {

/// A fact that a run's folder does not record.
inline constexpr const char* not_recorded = "unknown";
/// Author of runs that a rebuild adds.
inline constexpr const char* by_rebuild = "auto:rebuild";

/// Folders and files of the daemon.
struct CataloguePaths {
  std::filesystem::path data, rig, recipes;  ///< absolute
};

/// A run without a number, and the recipe that it was recorded with.
struct FoundRun {
  StoredRun run;
  CheckedRecipe recipe;
};

/// Reads the campaign in `folder`. The run is ended, or interrupted if the file does not record the
/// campaign's end; facts missing in the file are not_recorded. Thread: any. Errors: not_found, no
/// campaign there; busy, a process is recording there; parse, corrupt, unsupported.
Result<FoundRun> load_found_run(const std::filesystem::path& folder, const CataloguePaths& paths);

/// Adds the run with the number of its folder, if the folder is in `data` and the number is free;
/// otherwise with the next new number. It counts as ended: only the daemon of its own folder can
/// continue it. Errors: wrong_state, the folder is known already; io.
Result<StoredRun> add_found_run(RunStore& store, const CataloguePaths& paths, FoundRun found,
                                std::string_view by, std::int64_t utc_us);

/// Result of a rebuild.
struct RebuildReport {
  std::vector<StoredRun> added;
  std::vector<Error> left_out;    ///< folders that could not be read, with the reason
  std::filesystem::path damaged;  ///< where the damaged file is kept; empty without one
  std::int64_t next_number = 0;
  bool is_latched = false;  ///< the damaged file does not show that the rig was free
};
/// Adds every run of `data` that the catalogue does not have. A damaged catalogue is renamed first;
/// the new one has an empty queue and a rig in an unknown state. A readable catalogue keeps its
/// contents. Errors: busy, a weftd is running there; io.
Result<RebuildReport> rebuild_catalogue(const CataloguePaths& paths, std::int64_t utc_us);

}  // namespace weft::daemon::runs
