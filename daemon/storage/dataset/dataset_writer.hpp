#pragma once
// Writes a data set trial by trial, so that only one trial at a time is in memory.

#include <filesystem>
#include <memory>
#include <vector>

#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// How taxel counts are stored.
enum class CountFormat : std::uint8_t {
  whole,  ///< u16: every count is a whole number from 0 to 65535
  real    ///< f64
};

/// Writes to a temporary file beside `path` and renames it in finish(): an older file survives
/// every failure. After the first error every call returns it. Layout: docs/reference/dataset.md,
/// "HDF5 layout". One thread; it holds the HDF5 library only inside its calls.
class DatasetWriter {
 public:
  /// Errors: io; check(Dataset)'s for the names of group columns.
  static Result<DatasetWriter> create(const std::filesystem::path& path, DatasetInfo info,
                                      CountFormat counts = CountFormat::whole);
  DatasetWriter(DatasetWriter&&) noexcept;
  DatasetWriter& operator=(DatasetWriter&&) = delete;
  ~DatasetWriter();  ///< without finish() nothing is left

  /// Trials in the order of the data set. Returns the trial's digest. Errors: check_trial()'s and
  /// TrialSequence's; invalid_argument for a count that does not fit the format; io.
  Result<std::string> add(const classifier::Trial& trial, const TrialRecord& record);
  /// `ended_early`: replaces the one of `info`. Returns the digests stored in the file. Errors: io;
  /// invalid_argument without trials.
  Result<DatasetDigest> finish(std::vector<EndedEarly> ended_early);

 private:
  struct Impl;
  explicit DatasetWriter(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace weft::daemon
