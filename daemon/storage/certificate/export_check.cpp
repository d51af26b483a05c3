#include "daemon/storage/certificate/export_check.hpp"

#include <array>

#include "daemon/storage/certificate/exports.hpp"
#include "daemon/storage/certificate/file_checksums.hpp"
#include "daemon/storage/recorder/recorder.hpp"

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 5> export_states{"current", "outdated", "discarded",
                                                        "missing", "altered"};

std::string name_of(const ExportedFile& file) {
  return std::string(export_folder_name) + "/" + file.name;
}

// Trials are only ever added to a campaign: as many are the same ones.
ExportState state_of(const ExportedFile& file, const fs::path& folder,
                     const CampaignProgress& now) {
  std::error_code unseen;
  if (!fs::is_regular_file(folder / name_of(file), unseen)) return ExportState::missing;
  if (now.discarded) return ExportState::discarded;
  return file.done == now.done ? ExportState::current : ExportState::outdated;
}

std::vector<CheckedExport> compared(const fs::path& folder, const std::vector<ExportedFile>& files,
                                    const CampaignProgress& now) {
  std::vector<CheckedExport> out;
  for (const ExportedFile& file : files)
    out.push_back({name_of(file), file.trials, file.done, now.done, state_of(file, folder, now)});
  return out;
}

/// Nothing where it is as listed.
std::string difference(const ExportedFile& listed, const fs::path& file,
                       const StopRequested& stop_requested) {
  const auto now = file_checksums(file, {}, stop_requested);
  if (!now) return to_string(now.error());
  if (now->sha256 == listed.sha256) return {};
  return "altered (expected SHA-256 " + listed.sha256 + ", got " + now->sha256 + ")";
}

}  // namespace

std::string_view to_string(ExportState state) {
  return export_states[static_cast<std::size_t>(state)];
}

Result<std::vector<CheckedExport>> exports_now(const fs::path& folder) {
  const auto files = listed_exports(folder);
  if (!files) return pass(files.error());
  if (files->empty()) return std::vector<CheckedExport>{};
  const auto now = load_progress(folder / campaign_file_name);
  if (!now) return pass(now.error());
  return compared(folder, *files, *now);
}

void check_exports(const fs::path& folder, const StopRequested& stop_requested,
                   VerifyReport& report) {
  const auto files = listed_exports(folder);
  if (!files)
    return report.found_problems.push_back(
        {std::string(export_folder_name) + "/" + export_list_name, to_string(files.error())});
  if (files->empty()) return;
  const auto now = load_progress(folder / campaign_file_name);
  if (now) report.exports = compared(folder, *files, *now);  // else its file's findings say why
  for (std::size_t i = 0; i < files->size(); ++i) {
    const std::string name = name_of((*files)[i]);
    std::error_code unseen;
    if (!fs::exists(folder / name, unseen)) continue;
    std::string what = difference((*files)[i], folder / name, stop_requested);
    if (what.empty()) continue;
    if (now) report.exports[i].state = ExportState::altered;
    report.found_problems.push_back(
        {name, std::move(what),
         "weft export (of a daemon, data.export) makes it anew, of the campaign beside it"});
  }
}

}  // namespace weft::daemon
