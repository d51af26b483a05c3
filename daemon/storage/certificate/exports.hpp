#pragma once
// Files that are made of a campaign when somebody asks for them, beside what its run left:
// export/dataset.h5, export/features-M1.csv, and export/list.json, which has their digests.

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

// Whether what was exported of a campaign is what its list says, and still of all that there is. A
// run that is gone on with leaves its exports as they are: they are of the trials of then.

std::string_view to_string(ExportState state);

/// How each export that is listed in `folder` stands to the campaign as it is now, without a look
/// at its bytes; empty where nothing was exported. Errors: listed_exports()'s, load_progress()'s.
Result<std::vector<CheckedExport>> exports_now(const std::filesystem::path& folder);

/// Adds the exports to `report`, their bytes looked at: an altered one is a finding. One that is
/// missing or outdated is none, for nothing that was recorded is.
void check_exports(const std::filesystem::path& folder, const StopRequested& stop_requested,
                   VerifyReport& report);

inline constexpr const char* export_folder_name = "export";
inline constexpr const char* export_list_name = "list.json";

enum class ExportFormat : std::uint8_t {
  hdf5,         ///< the complete trials, as `weft dataset export` writes them
  samples_csv,  ///< samples of one stream, see write_samples_csv()
  features_csv  ///< their features, as `weft fabric features` writes them
};
std::string_view to_string(ExportFormat format);
std::optional<ExportFormat> export_format_from(std::string_view word);

struct ExportedFile {
  std::string name;  ///< in export/: "dataset.h5"
  std::uint64_t bytes = 0;
  std::string sha256;          ///< of the file
  std::string dataset_sha256;  ///< of the trials that it was made of
  std::string bench;           ///< "simulated", "real" or "unknown"
  std::uint64_t trials = 0;    ///< that are in it
  std::uint64_t planned = 0;   ///< of the campaign
  std::uint64_t done = 0;      ///< that the campaign had by then, as CampaignProgress has it
};

struct ExportRequest {
  ExportFormat format = ExportFormat::hdf5;
  std::string exploration;        ///< of features: needed where the campaign has several
  Stream stream = Stream::taxel;  ///< of samples
  StopRequested stop_requested = {};
};

/// Of the campaign file in `folder`, which nobody writes to; takes the place of an older export of
/// that name. Errors: load_campaign()'s, also for a discarded campaign; not_found, without a
/// complete trial, such an exploration or stream; invalid_argument, for features of several
/// explorations; io, also where the disk has no room.
Result<ExportedFile> export_campaign(const std::filesystem::path& folder,
                                     const ExportRequest& request);

/// What the list names, without a look at the files; empty where nothing was exported.
/// Errors: parse.
Result<std::vector<ExportedFile>> listed_exports(const std::filesystem::path& folder);

}  // namespace weft::daemon
