#pragma once
// Runs as their folders describe them: a catalogue (weftd.sqlite) that was lost or damaged is made
// again from them, and a folder made by `weft run` is added to it.

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/service/run_store/run_store.hpp"

namespace weft::daemon::runs {

/// A fact that a run's folder does not record.
inline constexpr const char* not_recorded = "unknown";
/// Who adds runs that a rebuild finds.
inline constexpr const char* by_rebuild = "auto:rebuild";

/// Where the daemon works.
struct CataloguePaths {
  std::filesystem::path data, rig, recipes;  ///< absolute
};

/// A run without a number, and the recipe that it was recorded with.
struct FoundRun {
  StoredRun run;
  CheckedRecipe recipe;
};

/// Reads the campaign in `folder`. Ended, or interrupted if the file says that the campaign did not
/// come to its end; what the file does not say is not_recorded. On any thread. Errors: not_found,
/// no campaign there; busy, a process records there; parse, corrupt, unsupported.
Result<FoundRun> load_found_run(const std::filesystem::path& folder, const CataloguePaths& paths);

/// Adds it with the number of its folder, if the folder lies in `data` and the number is free, else
/// with the next new one. It has ended then: only its own folder's daemon continues it.
/// Errors: wrong_state, the folder is known already; io.
Result<StoredRun> add_found_run(RunStore& store, const CataloguePaths& paths, FoundRun found,
                                std::string_view by, std::int64_t utc_us);

/// What a rebuild did.
struct RebuildReport {
  std::vector<StoredRun> added;
  std::vector<Error> left_out;    ///< folders that could not be read, and why
  std::filesystem::path damaged;  ///< where the damaged file is kept; empty without one
  std::int64_t next_number = 0;
  bool is_latched = false;  ///< the damaged file did not say that the rig was free
};
/// Adds every run of `data` that the catalogue does not know. A damaged catalogue is renamed first,
/// and the new one has an empty queue and a rig in an unknown state. One that can be read keeps all
/// that it has. Errors: busy, a weftd works there; io.
Result<RebuildReport> rebuild_catalogue(const CataloguePaths& paths, std::int64_t utc_us);

}  // namespace weft::daemon::runs
