#include "daemon/storage/certificate/exports.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <nlohmann/json.hpp>

#include "classifier/features/feature_matrix.hpp"
#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/text/format.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/dataset/dataset.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/dataset/import.hpp"
#include "daemon/storage/recorder/log_check.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "protocols/base/json_text.hpp"

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* list_format = "weft-exports";
constexpr std::array<std::string_view, 3> words{"hdf5", "samples-csv", "features-csv"};

/// The exploration to compute features of. Errors: invalid_argument, not_found.
Result<std::string> find_exploration(const Dataset& dataset, const std::string& wanted) {
  const std::vector<std::string> known = list_explorations(dataset);
  if (wanted.empty() && known.size() == 1) return known.front();
  if (wanted.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = "/exploration",
                 .what = "exploration missing, the campaign has several",
                 .expected = "one of " + joined(known)});
  if (std::ranges::find(known, wanted) != known.end()) return wanted;
  return fail({.code = Errc::not_found,
               .where = "/exploration",
               .what = "unknown exploration",
               .expected = joined(known),
               .got = wanted.substr(0, 100)});
}

/// Returns the number of trials written.
Result<std::size_t> write_feature_table(const Dataset& dataset, const std::string& exploration,
                                        const fs::path& file) {
  std::vector<classifier::Trial> trials;
  for (std::size_t i = 0; i < dataset.trials.size(); ++i)
    if (dataset.records[i].spec.exploration == exploration) trials.push_back(dataset.trials[i]);
  const auto features = classifier::build_feature_matrix(trials, {}, 1);
  if (!features) return pass(features.error());
  if (Status ok = export_features_csv(file, *features, factor_columns(dataset, *features)); !ok)
    return pass(ok.error());
  return trials.size();
}

json export_json(const ExportedFile& file) {
  return {{"name", file.name},
          {"bytes", file.bytes},
          {"sha256", file.sha256},
          {"dataset_sha256", file.dataset_sha256},
          {"bench", file.bench},
          {"trials", file.trials},
          {"trials_planned", file.planned},
          {"trials_done", file.done}};
}

ExportedFile export_from(const json& one) {
  return {
      one.at("name"),           one.at("bytes"),
      one.at("sha256"),         one.at("dataset_sha256"),
      one.at("bench"),          one.at("trials"),
      one.at("trials_planned"), one.value("trials_done", one.at("trials").get<std::uint64_t>())};
}

Status write_export_list(const fs::path& folder, const std::vector<ExportedFile>& known) {
  json files = json::array();
  for (const ExportedFile& one : known) files.push_back(export_json(one));
  const json list{{"format", list_format}, {"version", 1}, {"files", std::move(files)}};
  return write_text_file(folder / export_folder_name / export_list_name, list.dump(1) + "\n");
}

/// These write the content of export_campaign() to `file`. They fill in the members known at that
/// point.
Result<ExportedFile> write_as_hdf5(const Dataset& dataset, const fs::path& file,
                                   const StopRequested& stop_requested) {
  auto digest = write_hdf5(dataset, file, stop_requested);
  if (!digest) return pass(digest.error());
  ExportedFile made;
  made.trials = dataset.trials.size();
  made.dataset_sha256 = std::move(*digest);
  return made;
}

Result<ExportedFile> write_as_features(const Dataset& dataset, const std::string& exploration,
                                       const fs::path& file, const StopRequested& stop_requested) {
  const auto rows = write_feature_table(dataset, exploration, file);
  if (!rows) return pass(rows.error());
  auto digest = compute_digest(dataset, stop_requested);
  if (!digest) return pass(digest.error());
  ExportedFile made;
  made.trials = *rows;
  made.dataset_sha256 = std::move(digest->dataset_sha256);
  return made;
}

Status make_export_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directory(folder / export_folder_name, error);
  if (!error) return {};
  return fail({.code = Errc::io,
               .where = (folder / export_folder_name).string(),
               .what = "folder not created",
               .got = error.message()});
}

/// Replaces an older export of the same name. If this is interrupted, the list never holds the
/// digest of another file: between the two steps it does not name the export.
Status publish_listed(const fs::path& folder, const ExportedFile& made, AtomicFile& file) {
  auto known = listed_exports(folder);
  if (!known) return pass(known.error());
  const auto gone =
      std::erase_if(*known, [&](const ExportedFile& one) { return one.name == made.name; });
  if (gone > 0)
    if (Status ok = write_export_list(folder, *known); !ok) return ok;
  if (Status ok = file.publish(); !ok) return ok;
  known->push_back(made);
  return write_export_list(folder, *known);
}

tl::unexpected<Error> no_complete_trial(const fs::path& campaign) {
  return fail({.code = Errc::not_found,
               .where = campaign.string(),
               .what = "campaign has no complete trial"});
}

/// Puts the finished file in place and updates the list.
Result<ExportedFile> publish_made(const fs::path& folder, const CampaignProgress& progress,
                                  ExportedFile made, AtomicFile& file,
                                  const StopRequested& stop_requested) {
  const auto checksums = file_checksums(file.temporary(), stop_requested);
  if (!checksums) return pass(checksums.error());
  made.bytes = checksums->bytes;
  made.sha256 = checksums->sha256;
  made.planned = progress.planned;
  made.done = progress.done;
  if (Status ok = publish_listed(folder, made, file); !ok) return pass(ok.error());
  return made;
}

/// A stage sample has 24 bytes on record and about 100 as text. Other streams may need more; the
/// file is written whole or not at all.
constexpr std::uintmax_t text_per_byte = 5;

Result<ExportedFile> export_samples(const fs::path& folder, const CampaignProgress& progress,
                                    const ExportRequest& request) {
  const fs::path campaign = folder / campaign_file_name;
  if (progress.discarded)
    return fail({.code = Errc::wrong_state,
                 .where = campaign.string(),
                 .what = "campaign discarded, nothing to export"});
  if (progress.done == 0) return no_complete_trial(campaign);
  if (Status made = make_export_folder(folder); !made) return pass(made.error());
  const std::string stream(sample_stream_names()[static_cast<std::size_t>(request.stream)]);
  ExportedFile made;
  made.name = "samples-" + stream + ".csv";
  AtomicFile file(folder / export_folder_name / made.name);
  std::ofstream out(file.temporary(), std::ios::binary);
  const auto written = write_samples_csv(campaign, request.stream, out, request.stop_requested);
  if (!written) return pass(written.error());
  out.close();
  if (!out)
    return fail({.code = Errc::io,
                 .where = (folder / export_folder_name / made.name).string(),
                 .what = "table not written",
                 .hint = "Free some space on the disk"});
  if (written->trials == 0) return no_complete_trial(campaign);
  made.trials = written->trials;
  made.dataset_sha256 = written->dataset_sha256;
  made.bench = written->bench;
  return publish_made(folder, progress, std::move(made), file, request.stop_requested);
}

Result<ExportedFile> export_dataset(const fs::path& folder, const CampaignProgress& progress,
                                    const ExportRequest& request) {
  const fs::path campaign = folder / campaign_file_name;
  const auto dataset = load_campaign(campaign, {.stop_requested = request.stop_requested});
  if (!dataset) return pass(dataset.error());
  if (dataset->trials.empty()) return no_complete_trial(campaign);
  if (Status made = make_export_folder(folder); !made) return pass(made.error());
  const bool features = request.format == ExportFormat::features_csv;
  const auto exploration =
      features ? find_exploration(*dataset, request.exploration) : Result<std::string>("");
  if (!exploration) return pass(exploration.error());
  const std::string name = features ? "features-" + *exploration + ".csv" : dataset_file_name;
  AtomicFile file(folder / export_folder_name / name);
  auto made =
      features ? write_as_features(*dataset, *exploration, file.temporary(), request.stop_requested)
               : write_as_hdf5(*dataset, file.temporary(), request.stop_requested);
  if (!made) return pass(made.error());
  made->name = name;
  made->bench = to_string(dataset->info.kind);
  return publish_made(folder, progress, std::move(*made), file, request.stop_requested);
}

constexpr std::array<std::string_view, 5> export_states{"current", "outdated", "discarded",
                                                        "missing", "altered"};

std::string name_of(const ExportedFile& file) {
  return std::string(export_folder_name) + "/" + file.name;
}

// A campaign only ever gains trials, so an equal count means equal trials.
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

/// Empty if the file is as listed.
std::string difference(const ExportedFile& listed, const fs::path& file,
                       const StopRequested& stop_requested) {
  const auto now = file_checksums(file, stop_requested);
  if (!now) return to_string(now.error());
  if (now->sha256 == listed.sha256) return {};
  return "altered, SHA-256 differs: " + now->sha256 + " (expected " + listed.sha256 + ")";
}

}  // namespace

std::string_view to_string(ExportFormat format) {
  return words[static_cast<std::size_t>(format)];
}

std::optional<ExportFormat> export_format_from(std::string_view word) {
  return enum_named<ExportFormat>(words, word);
}

Result<ExportedFile> export_campaign(const fs::path& folder, const ExportRequest& request) {
  const fs::path campaign = folder / campaign_file_name;
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(campaign, error);
  if (error)
    return fail(
        {.code = Errc::not_found, .where = campaign.string(), .what = "campaign file not found"});
  const bool samples = request.format == ExportFormat::samples_csv;
  if (Status room = check_space(folder, samples ? bytes * text_per_byte : bytes); !room)
    return pass(room.error());
  if (Status whole = check_wal(campaign); !whole) return pass(whole.error(), folder.string());
  const auto progress = load_progress(campaign);
  if (!progress) return pass(progress.error());
  return samples ? export_samples(folder, *progress, request)
                 : export_dataset(folder, *progress, request);
}

Result<std::vector<ExportedFile>> listed_exports(const fs::path& folder) {
  const fs::path file = folder / export_folder_name / export_list_name;
  std::error_code unseen;
  if (!fs::exists(file, unseen)) return std::vector<ExportedFile>{};
  const auto text = read_text_file(file);
  if (!text) return pass(text.error());
  const auto parsed = parse_json(*text);
  if (!parsed) return pass(parsed.error(), file.string());
  const json& list = *parsed;
  try {
    if (list.at("format") != list_format || list.at("version") != 1)
      return fail({.code = Errc::parse, .where = file.string(), .what = "not a Weft export list"});
    std::vector<ExportedFile> out;
    for (const json& one : list.at("files")) out.push_back(export_from(one));
    return out;
  } catch (const json::exception& e) {
    return fail({.code = Errc::parse,
                 .where = file.string(),
                 .what = "not a Weft export list",
                 .got = e.what()});
  }
}

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
    return report.add(std::string(export_folder_name) + "/" + export_list_name,
                      to_string(files.error()));
  if (files->empty()) return;
  const auto now = load_progress(folder / campaign_file_name);
  if (now)
    report.exports = compared(folder, *files, *now);  // otherwise the findings of the
                                                      // campaign file give the reason
  for (std::size_t i = 0; i < files->size(); ++i) {
    const std::string name = name_of((*files)[i]);
    std::error_code unseen;
    if (!fs::exists(folder / name, unseen)) continue;
    std::string what = difference((*files)[i], folder / name, stop_requested);
    if (what.empty()) continue;
    if (now) report.exports[i].state = ExportState::altered;
    report.add(name, std::move(what), "Export again with `weft export` (daemon: data.export)");
  }
}

}  // namespace weft::daemon
