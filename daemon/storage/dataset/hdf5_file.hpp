#pragma once
// The exchange format: one HDF5 file per data set, layout in docs/dataset.md.

#include <filesystem>

#include "daemon/base/file/stop_requested.hpp"
#include "daemon/storage/dataset/dataset.hpp"

// One thread at a time is in the HDF5 library; digests and the way to the disk, which take longest,
// are no part of that.

namespace weft::daemon {

struct Hdf5Options {
  int deflate_level = 1;  ///< 0 to 9; 1 already finds most of what shuffled counts have to give
  StopRequested stop_requested = {};  ///< before each trial's digest and each group of columns
};

struct Hdf5LoadOptions {
  bool streams =
      true;  ///< false leaves wrench and stage streams on disk; digests are then not checked
  bool verify_digest = true;          ///< and /phases, which follows from what they cover
  StopRequested stop_requested = {};  ///< before each trial's digest
};

/// Writes beside `path` and renames on success: an older file survives every failure. Returns the
/// digest that the file carries. Errors: check(dataset)'s, Errc::io; wrong_state, when it was
/// stopped.
Result<std::string> write_hdf5(const Dataset& dataset, const std::filesystem::path& path,
                               const Hdf5Options& options = {});

/// Errors: not_found; parse (not HDF5, or not a Weft data set); unsupported (a later layout);
/// corrupt (cut short, altered, or a digest that disagrees: names the trial).
Result<Dataset> read_hdf5(const std::filesystem::path& path, const Hdf5LoadOptions& options = {});

}  // namespace weft::daemon
