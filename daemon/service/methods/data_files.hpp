#pragma once
// The files of a run's data set that may be fetched: those that its certificate, its hand-over or
// its exports list, and these lists themselves. Nothing else of a folder has a name here, and
// nothing is given out that is not what its list says.

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
  std::string name;  ///< in the run's folder: "dataset.h5", "handover/M1.model"
  std::uint64_t bytes = 0;
  std::string sha256;
};

/// Reads lists and hashes files, and remembers both for as long as nobody has written to them.
/// Used by one thread, which is not the server's: a list may have megabytes, a file gigabytes.
class DataFiles {
 public:
  /// `utc_now`: since 1970-01-01, as files have it. `stop_requested`: while a file is hashed.
  explicit DataFiles(std::function<std::chrono::nanoseconds()> utc_now,
                     StopRequested stop_requested = {})
      : utc_now_(std::move(utc_now)), stop_requested_(std::move(stop_requested)) {}

  /// Of a run's folder. Errors: not_found, when the run has come to no end that was certified and
  /// nothing of it was exported; certificate_from_json()'s.
  Result<std::vector<DataFile>> list(const std::filesystem::path& folder);
  /// One of them, open, its bytes hashed. Errors: list()'s; not_found; wrong_state, when they are
  /// not what the list says, or a symbolic link leads to them.
  Result<server::ServedFile> open(const std::filesystem::path& folder, const std::string& name);

  /// daemon::verify() of a run's folder: a second for each 150 MB.
  Result<VerifyReport> verify(const std::filesystem::path& folder) const {
    return daemon::verify(folder, stop_requested_);
  }

  /// export_campaign() of a run's folder: seconds for hours of recording.
  Result<ExportedFile> make_export(const std::filesystem::path& folder,
                                   ExportRequest request) const {
    request.stop_requested = stop_requested_;
    return export_campaign(folder, request);
  }

  /// What has been done so far.
  struct Work {
    std::size_t lists_read = 0, files_hashed = 0;
  };
  [[nodiscard]] const Work& work() const { return work_; }

 private:
  using Stamp = OpenFile::Stamp;
  /// Of certificate, evaluation and exports; nothing where there is no such file.
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
