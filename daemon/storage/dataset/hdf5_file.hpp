#pragma once
// The exchange format: one HDF5 file per data set, layout in docs/dataset.md.

#include <filesystem>

#include "daemon/base/file/read_file.hpp"
#include "daemon/storage/dataset/dataset.hpp"

// One thread at a time is in the HDF5 library; digests and the way to the disk, which take longest,
// are no part of that.

namespace weft::daemon {

/// Writes beside `path` and renames on success: an older file survives every failure. Returns the
/// digest that the file carries. Errors: check(dataset)'s, Errc::io; wrong_state, when it was
/// stopped: `stop_requested` is looked at before each trial's digest and each group of columns.
Result<std::string> write_hdf5(const Dataset& dataset, const std::filesystem::path& path,
                               const StopRequested& stop_requested = {});

/// The same of a data set whose digest is known.
Status write_hdf5(const Dataset& dataset, const DatasetDigest& digest,
                  const std::filesystem::path& path, const StopRequested& stop_requested = {});

/// Errors: not_found; parse (not HDF5, or not a Weft data set); unsupported (a later layout);
/// corrupt (cut short, altered, or a digest that disagrees: names the trial). Without
/// `verify_digest` neither digests nor /phases, which follows from what they cover, are compared.
/// wrong_state, when it was stopped: `stop_requested` is looked at before each trial's digest.
Result<Dataset> read_hdf5(const std::filesystem::path& path, bool verify_digest = true,
                          const StopRequested& stop_requested = {});

}  // namespace weft::daemon
