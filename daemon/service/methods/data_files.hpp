#pragma once
// Files of a run's data set that clients may fetch: those listed in its certificate, its handover
// or its exports, and these lists themselves. No other file of the folder can be named. A file that
// differs from its list entry is not served.

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "daemon/base/file/read_file.hpp"
#include "daemon/service/rpc/session.hpp"
#include "daemon/storage/certificate/exports.hpp"
#include "daemon/storage/certificate/verify.hpp"

namespace weft::daemon::api {

struct DataFile {
  std::string name;  ///< relative to the run's folder: "dataset.h5", "handover/M1.model"
  std::uint64_t bytes = 0;
  std::string sha256;
};

/// Reads lists and hashes files, and caches both until the files are modified. Thread: one, not the
/// server's, because a list may have megabytes and a file gigabytes.
class DataFiles {
 public:
  /// `utc_now`: time since 1970-01-01, the origin of file times. `stop_requested`: checked while a
  /// file is hashed.
  explicit DataFiles(std::function<std::chrono::nanoseconds()> utc_now,
                     StopRequested stop_requested = {})
      : utc_now_(std::move(utc_now)), stop_requested_(std::move(stop_requested)) {}

  /// Lists a run's folder. Errors: not_found, if the run has neither a certificate nor an export;
  /// those of certificate_from_json().
  Result<std::vector<DataFile>> list(const std::filesystem::path& folder);
  /// Opens one listed file and verifies its digest. Errors: those of list(); not_found;
  /// wrong_state, if its bytes differ from the list or the path has a symbolic link.
  Result<server::ServedFile> open(const std::filesystem::path& folder, const std::string& name);

  /// daemon::verify() of a run's folder: one second per 150 MB.
  Result<VerifyReport> verify(const std::filesystem::path& folder) const {
    return daemon::verify(folder, stop_requested_);
  }

  /// export_campaign() of a run's folder: takes seconds for hours of recording.
  Result<ExportedFile> make_export(const std::filesystem::path& folder,
                                   ExportRequest request) const {
    request.stop_requested = stop_requested_;
    return export_campaign(folder, request);
  }

  /// Work done so far [count].
  struct Work {
    std::size_t lists_read = 0, files_hashed = 0;
  };
  [[nodiscard]] const Work& work() const { return work_; }

 private:
  using Stamp = OpenFile::Stamp;
  /// Stamps of certificate, evaluation and export list; empty if the file does not exist.
  using Stamps = std::array<std::optional<Stamp>, 3>;
  struct Listed {
    Stamps as_of;
    std::vector<DataFile> files;
  };
  struct Hashed {
    Stamp as_of;
    std::string sha256;
  };
  static Stamps read_stamps(const std::filesystem::path& folder);
  [[nodiscard]] bool is_settled(const Stamp& stamp) const;
  Result<std::string> compute_digest(const OpenFile& file, const Stamp& as_of);

  std::function<std::chrono::nanoseconds()> utc_now_;
  StopRequested stop_requested_;
  Work work_;
  std::map<std::filesystem::path, Listed> lists_;                     // by folder
  std::map<std::pair<std::uint64_t, std::uint64_t>, Hashed> hashed_;  // by device and inode
};

}  // namespace weft::daemon::api
