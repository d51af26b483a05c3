#include "daemon/storage/certificate/verify.hpp"

#include <algorithm>

#include "daemon/storage/certificate/campaign_check.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/certificate/export_check.hpp"
#include "daemon/storage/certificate/handover_file.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/recorder/campaign_history.hpp"
#include "daemon/storage/recorder/log_check.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "daemon/storage/recordings/recording_set.hpp"

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;

bool there(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

const FileChecksums* certified_file(const Certificate& certificate, const fs::path& file) {
  const auto found =
      std::find_if(certificate.files.begin(), certificate.files.end(),
                   [&](const FileChecksums& f) { return f.name == file.filename(); });
  return found == certificate.files.end() ? nullptr : &*found;
}

void compare_bytes(const FileChecksums& then, const fs::path& file,
                   const StopRequested& stop_requested, VerifyReport& report) {
  const auto now = file_checksums(file, {}, stop_requested);
  const std::string name = file.filename().string();
  if (!now) return report.found_problems.push_back({name, to_string(now.error())});
  if (now->bytes != then.bytes)
    report.found_problems.push_back(
        {name,
         std::to_string(now->bytes) + " bytes long, certified were " + std::to_string(then.bytes)});
  for (const AlteredBytes& run : altered(then, *now))
    report.found_problems.push_back({name + ": bytes " + std::to_string(run.first) + " to " +
                                         std::to_string(run.first + run.bytes - 1),
                                     "altered: " + run.holds});
}

/// Sound and vibration: a data set of another layout, with a digest of its own.
void check_recordings(const fs::path& file, VerifyReport& report) {
  const auto set = read_recordings(file);
  if (!set)
    return report.found_problems.push_back({file.filename().string(), to_string(set.error())});
  report.dataset_sha256 = recordings_sha256(*set);
  report.planned = report.complete = report.attempts = set->recordings.size();
  report.of = "recordings";
}

void check_dataset(const fs::path& file, const Certificate* certificate, VerifyReport& report) {
  if (certificate == nullptr && is_recordings_file(file)) return check_recordings(file, report);
  const auto dataset = read_hdf5(file);
  const std::string name = file.filename().string();
  if (!dataset) return report.found_problems.push_back({name, to_string(dataset.error())});
  report.dataset_sha256 = dataset_sha256(*dataset);
  report.software_version = dataset->info.software_version;
  check_documents(dataset->info, name + ": /provenance", report);
  if (report.campaign.empty())
    report.planned = report.complete = report.attempts = dataset->trials.size();
  if (certificate == nullptr || certificate->dataset_sha256 == report.dataset_sha256) return;
  report.found_problems.push_back({name, "another data set than the certified one (expected " +
                                             certificate->dataset_sha256 + ", got " +
                                             report.dataset_sha256 + ")"});
}

/// What of `path` there is to look at.
Result<VerifyReport> inspect(const fs::path& path) {
  VerifyReport report;
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    const fs::path campaign = path / campaign_file_name;
    if (there(campaign) || has_log(campaign)) report.campaign = campaign;
    if (there(path / dataset_file_name)) report.dataset = path / dataset_file_name;
    if (report.campaign.empty() && report.dataset.empty())
      return fail({.code = Errc::not_found,
                   .where = path.string(),
                   .what = "neither campaign.sqlite nor dataset.h5 in this folder"});
    return report;
  }
  if (!there(path) && !has_log(path))
    return fail(
        {.code = Errc::not_found, .where = path.string(), .what = "no such file or folder"});
  // A campaign file whose first bytes are gone is still one by its name.
  const bool campaign = is_campaign_file(path) || path.filename() == campaign_file_name;
  (campaign ? report.campaign : report.dataset) = path;
  return report;
}

/// What a certificate lists is there, and what is there is listed.
bool is_as_listed(const Certificate& certificate, const fs::path& folder, VerifyReport& report) {
  const std::size_t before = report.found_problems.size();
  for (const FileChecksums& file : certificate.files)
    if (!there(folder / file.name))
      report.found_problems.push_back({file.name, "is in the certificate, and missing"});
  for (const fs::path& file : {report.campaign, report.dataset})
    if (!file.empty() && certified_file(certificate, file) == nullptr)
      report.found_problems.push_back({file.filename().string(), "is not in the certificate"});
  return report.found_problems.size() == before;
}

void check_file(const fs::path& file, const Certificate* certificate,
                const StopRequested& stop_requested, VerifyReport& report) {
  const FileChecksums* then = certificate == nullptr ? nullptr : certified_file(*certificate, file);
  const bool is_campaign = file == report.campaign;
  if (then != nullptr) compare_bytes(*then, file, stop_requested, report);
  // A certificate is of a finished file.
  if (is_campaign && then != nullptr && has_log(file))
    report.found_problems.push_back(
        {file.filename().string(),
         "was written to after it had been certified: its log is not empty"});
  // One that was killed before it had written anything holds nothing that could be wrong.
  report.blank |= is_campaign && is_blank_campaign(file);
  if (report.blank && certificate == nullptr && report.dataset.empty()) return;
  if (is_campaign)
    check_campaign(file, then == nullptr ? nullptr : certificate, stop_requested, report);
  else
    check_dataset(file, then == nullptr ? nullptr : certificate, report);
}

}  // namespace

Result<VerifyReport> verify(const fs::path& path, const StopRequested& stop_requested) {
  auto report = inspect(path);
  if (!report) return report;
  const fs::path& file = report->campaign.empty() ? report->dataset : report->campaign;
  const auto read = read_certificate(file.parent_path());
  const Certificate* certificate = nullptr;
  if (!read)
    report->found_problems.push_back({certificate_file_name, to_string(read.error())});
  else if (*read)
    certificate = &**read;
  std::error_code ignored;
  if (certificate != nullptr)
    report->certified = fs::is_directory(path, ignored)
                            ? is_as_listed(*certificate, path, *report)
                            : certified_file(*certificate, file) != nullptr;
  for (const fs::path& each : {report->campaign, report->dataset})
    if (!each.empty()) check_file(each, certificate, stop_requested, *report);
  if (fs::is_directory(path, ignored)) {
    check_handover(path, certificate == nullptr ? "" : certificate->dataset_sha256, *report);
    check_exports(path, stop_requested, *report);
  }
  if (stop_requested && stop_requested()) return pass(stopped_early(path.string()));
  return report;
}

}  // namespace weft::daemon
