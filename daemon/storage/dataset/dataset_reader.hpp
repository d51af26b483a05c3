#pragma once
// Reads a data set file trial by trial, so that only one trial at a time is in memory.

#include <cstddef>
#include <filesystem>
#include <memory>

#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// An open data set file. One thread; it holds the HDF5 library only inside its calls.
class DatasetReader {
 public:
  /// Reads everything but the samples. Errors: read_hdf5()'s, but no digest is compared.
  static Result<DatasetReader> open(const std::filesystem::path& path);
  DatasetReader(DatasetReader&&) noexcept;
  DatasetReader& operator=(DatasetReader&&) noexcept;
  ~DatasetReader();

  /// The data set without its samples.
  [[nodiscard]] const Dataset& listed() const;
  /// As stored in the file.
  [[nodiscard]] const DatasetDigest& digest() const;
  /// A trial, by its place in the file. Errors: corrupt, also if its digest differs;
  /// check_trial()'s.
  Result<TrialData> load(std::size_t trial);
  /// The same without check_trial() and digest.
  Result<TrialData> read(std::size_t trial);
  /// Compares the data set's digest with those of its trials and the description they belong to.
  /// Where load() has checked every trial, the content is that of the digest. Errors: corrupt.
  [[nodiscard]] Status check_digest() const;

 private:
  struct Impl;
  explicit DatasetReader(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// A file that passed all checks, without its samples.
struct CheckedDataset {
  Dataset listed;
  DatasetDigest digest;
};
/// Checks a file as read_hdf5() does, with one trial in memory at a time. Errors: read_hdf5()'s.
Result<CheckedDataset> check_hdf5(const std::filesystem::path& path,
                                  const StopRequested& stop_requested = {});

}  // namespace weft::daemon
