#pragma once
// Exports of a campaign, made on request: export/dataset.h5, export/features-M1.csv and
// export/list.json, which holds their digests.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/base/file/read_file.hpp"
#include "daemon/storage/certificate/samples_csv.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon {

// Checks exports against their list and against the current campaign. Resuming a run does not
// update its exports; they become outdated.

std::string_view to_string(ExportState state);

/// Compares each listed export of `folder` with the campaign as it is now, without reading the
/// export's bytes. Empty if nothing was exported. Errors: listed_exports()'s, load_progress()'s.
Result<std::vector<CheckedExport>> exports_now(const std::filesystem::path& folder);

/// Adds the exports to `report` and reads their bytes: an altered export is a finding. A missing or
/// outdated export is not a finding, because no recorded data is affected.
void check_exports(const std::filesystem::path& folder, const StopRequested& stop_requested,
                   VerifyReport& report);

inline constexpr const char* export_folder_name = "export";
inline constexpr const char* export_list_name = "list.json";

enum class ExportFormat : std::uint8_t {
  hdf5,         ///< the complete trials, as `weft dataset export` writes them
  samples_csv,  ///< samples of one stream, see write_samples_csv()
  features_csv  ///< features of the trials, as `weft fabric features` writes them
};
std::string_view to_string(ExportFormat format);
std::optional<ExportFormat> export_format_from(std::string_view word);

struct ExportedFile {
  std::string name;  ///< in export/: "dataset.h5"
  std::uint64_t bytes = 0;
  std::string sha256;          ///< digest of the file
  std::string dataset_sha256;  ///< digest of the trials in it
  std::string bench;           ///< "simulated", "real" or "unknown"
  std::uint64_t trials = 0;    ///< trials in the file
  std::uint64_t planned = 0;   ///< trials of the campaign
  std::uint64_t done = 0;      ///< trials done when the file was made, as in CampaignProgress
};

struct ExportRequest {
  ExportFormat format = ExportFormat::hdf5;
  std::string exploration;        ///< for features; required if the campaign has several
  Stream stream = Stream::taxel;  ///< for samples
  StopRequested stop_requested = {};
};

/// Exports the campaign file in `folder`, which no process may be writing. Replaces an older export
/// of the same name. Errors: load_campaign()'s, also for a discarded campaign; not_found without a
/// complete trial or without that exploration or stream; invalid_argument for features of several
/// explorations; io; no_space.
Result<ExportedFile> export_campaign(const std::filesystem::path& folder,
                                     const ExportRequest& request);

/// Entries of the list; the files are not read. Empty if nothing was exported. Errors: parse.
Result<std::vector<ExportedFile>> listed_exports(const std::filesystem::path& folder);

}  // namespace weft::daemon
