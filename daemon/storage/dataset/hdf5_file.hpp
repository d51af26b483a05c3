#pragma once
// The exchange format: one HDF5 file per data set, layout in docs/reference/dataset.md.

#include <filesystem>

#include "daemon/base/file/read_file.hpp"
#include "daemon/storage/dataset/dataset.hpp"

// Only one thread at a time uses the HDF5 library. Computing digests and syncing to the disk take
// longest and need no lock.

namespace weft::daemon {

/// Writes to a temporary file beside `path` and renames it on success: an older file survives every
/// failure. Returns the digest stored in the file. Errors: check(dataset)'s; io; wrong_state if
/// stopped. `stop_requested` is checked before each trial.
Result<std::string> write_hdf5(const Dataset& dataset, const std::filesystem::path& path,
                               const StopRequested& stop_requested = {});

/// Errors: not_found; busy; parse (not HDF5, or not a Weft data set); unsupported (a later layout);
/// corrupt (truncated, altered, or a digest that disagrees: names the trial); wrong_state if
/// stopped. Without `verify_digest`, neither digests nor /phases are compared; /phases follows from
/// data that the digests cover. `stop_requested` is checked before each trial's digest.
Result<Dataset> read_hdf5(const std::filesystem::path& path, bool verify_digest = true,
                          const StopRequested& stop_requested = {});

}  // namespace weft::daemon
