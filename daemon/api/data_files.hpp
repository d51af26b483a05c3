#pragma once
// The files of a run's data set that may be fetched: those that its certificate or its hand-over
// lists, and these two lists themselves. Nothing else of a folder has a name here.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/control/run_desk.hpp"
#include "daemon/server/http_file.hpp"

namespace weft::daemon::api {

struct DataFile {
  std::string name;  ///< in the run's folder: "dataset.h5", "handover/M1.model"
  std::uint64_t bytes = 0;
  std::string sha256;
};

/// Errors: not_found, when the run has come to no end that was certified;
/// certificate_from_json()'s.
Result<std::vector<DataFile>> data_files(const std::filesystem::path& folder);

/// By "R-000318/dataset.h5". Errors: not_found; wrong_state, when the file is not as long as its
/// list says.
Result<server::ServedFile> served_file(const control::RunDesk& desk, std::string_view path);

}  // namespace weft::daemon::api
