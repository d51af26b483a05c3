#pragma once
// Redundant content of a data set file, for the convenience of readers: the first row of each
// trial, the runs of its phases, the size of a quantum. No digest covers it, so the reader compares
// it, if present, with the data from which it is derived.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "daemon/storage/dataset/dataset.hpp"
#include "daemon/storage/dataset/hdf5_columns.hpp"

namespace weft::daemon::hdf5 {

/// Runs of one phase within one trial, in the order of /taxel/phase.
struct PhaseRuns {
  std::vector<std::uint32_t> trial;    ///< index in /trials
  std::vector<std::uint8_t> phase;     ///< ASCII
  std::vector<std::uint64_t> first;    ///< first row in /taxel
  std::vector<std::uint64_t> samples;  ///< number of rows
  /// Adds the next trial.
  void add(const std::vector<Phase>& phases);
  bool operator==(const PhaseRuns& other) const {
    return trial == other.trial && phase == other.phase && first == other.first &&
           samples == other.samples;
  }

 private:
  std::uint32_t trials_ = 0;
  std::uint64_t rows_ = 0;
};
PhaseRuns phase_runs(const Dataset& dataset);
/// The runs stored in the file; nothing if it has none.
std::optional<PhaseRuns> read_phase_runs(Reader& in);

/// First row of each trial: the trials follow each other without gaps.
std::vector<std::uint64_t> compute_begins(const std::vector<std::uint64_t>& samples);

/// The number of rows of each trial in one family of columns; "taxel" reads /trials/taxel_samples.
/// The sum must be `rows`, so that every later slice lies within its column. /trials/taxel_first
/// must agree. Errors as in Reader::require; the same holds for the functions below.
std::vector<std::uint64_t> read_extents(Reader& in, const std::string& family, std::size_t trials,
                                        std::size_t rows);

/// Compares the column's attribute per_unit with `per_unit` [quanta per SI unit].
void compare_quantum(Reader& in, const std::string& column, double per_unit);
/// Compares /stages/per_unit with the quantum of each axis in the layout.
void compare_axes(Reader& in, const std::vector<Axis>& axes);

/// For a damaged column of samples, adds the trials with unreadable rows to the error's `where`:
/// "/taxel/counts of trial 0007-denim-M1-r03". Other errors are returned unchanged.
Error with_damaged_trials(Error error, const std::filesystem::path& file, const Dataset& dataset);

}  // namespace weft::daemon::hdf5
