#pragma once
// What a data set file says twice, for readers who would rather not count: where each trial's rows
// begin, the runs of its phases, what a quantum is. No digest covers it, so a reader compares it
// with what it follows from, where a file has it.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/storage/dataset/dataset.hpp"
#include "daemon/storage/dataset/hdf5_columns.hpp"

namespace weft::daemon::hdf5 {

/// Runs of one phase within one trial, in the order of /taxel/phase.
struct PhaseRuns {
  std::vector<std::uint32_t> trial;    ///< its place in /trials
  std::vector<std::uint8_t> phase;     ///< ASCII
  std::vector<std::uint64_t> first;    ///< row of /taxel
  std::vector<std::uint64_t> samples;  ///< rows
  bool operator==(const PhaseRuns&) const = default;
};
PhaseRuns phase_runs(const Dataset& dataset);
/// Those that the file tells of; nothing where it tells of none.
std::optional<PhaseRuns> read_phase_runs(Reader& in);

/// Where each trial's rows begin: behind those of the trials before.
std::vector<std::uint64_t> compute_begins(const std::vector<std::uint64_t>& samples);

/// The number of rows of each trial in one family of columns, "taxel" of /trials/taxel_samples. The
/// sum must be `rows`, so that every later slice lies within its column, and /trials/taxel_first
/// must be where the slices begin. Errors as of Reader::require, like those of all below.
std::vector<std::uint64_t> read_extents(Reader& in, const std::string& family, std::size_t trials,
                                        std::size_t rows);

/// The column's attribute per_unit with `per_unit` [quanta per SI unit].
void compare_quantum(Reader& in, const std::string& column, double per_unit);
/// /stages/per_unit with what the layout counts each axis in.
void compare_axes(Reader& in, const std::vector<Axis>& axes);

/// An error of a damaged column of samples, with the trials whose rows in it cannot be read in its
/// `where`: "/taxel/counts of trial 0007-denim-M1-r03". Any other error as it is.
Error with_damaged_trials(Error error, const std::filesystem::path& file, const Dataset& dataset);

}  // namespace weft::daemon::hdf5
