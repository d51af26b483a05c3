#include "daemon/storage/certificate/verify.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/certificate/exports.hpp"
#include "daemon/storage/certificate/handover_file.hpp"
#include "daemon/storage/dataset/dataset_reader.hpp"
#include "daemon/storage/recorder/campaign_history.hpp"
#include "daemon/storage/recorder/chunk.hpp"
#include "daemon/storage/recorder/log_check.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "daemon/storage/recordings/recording_set.hpp"
#include "protocols/base/bytes.hpp"

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::milliseconds for_a_moment{2'000};

/// Checks recipe and rig of a campaign file or data set against their SHA-256. `where`: place of a
/// finding.
void check_documents(const DatasetInfo& info, const std::string& where, VerifyReport& report) {
  const auto same = [&](const char* what, const std::string& text, const std::string& recorded) {
    if (!text.empty() && sha256_hex(text) != recorded)
      report.add(where, std::string(what) + " altered, SHA-256 differs");
  };
  same("recipe", info.recipe_json, info.recipe_sha256);
  same("rig", info.rig_json, info.rig_sha256);
}

/// Checks structure, every chunk's CRC-32, every trial's SHA-256 and every table's rows; adds to
/// `report`. `certificate`: null if there is none, or none for this state of the file. When
/// stopped, ends early with a finding that reports it.
class CampaignCheck {
 public:
  CampaignCheck(const std::filesystem::path& file, const Certificate* certificate,
                const StopRequested& stop_requested, VerifyReport& report)
      : file_(file), certificate_(certificate), stop_requested_(stop_requested), report_(report) {}

  /// Errors: busy if another program has locked the file, which is not a finding.
  Status run() {
    log();
    auto opened = sqlite::Database::open(file_, sqlite::Mode::read_only);
    if (opened)
      check_contents(std::move(*opened));
    else
      found({}, opened.error());
    return busy_ ? pass(*busy_) : Status{};
  }

 private:
  void found(const std::string& where, std::string what, std::string hint = {}) {
    const std::string name = file_.filename().string();
    report_.add(where.empty() ? name : name + ": " + where, std::move(what), std::move(hint));
  }
  void check_contents(sqlite::Database database) {
    database_ = std::move(database);
    database_.wait_for_others(for_a_moment);
    structure();
    if (busy_) return;
    progress();
    const std::size_t before = report_.found_problems.size();
    chunks();
    tables();
    trials(report_.found_problems.size() == before);
  }

  void found(const std::string& where, Error error) {
    if (error.code == Errc::busy) {
      if (!busy_) busy_ = std::move(error);
      return;
    }
    std::string hint = std::exchange(error.hint, {});
    found(where, to_string(error), std::move(hint));
  }

  /// Runs before SQLite opens the file, because SQLite omits damaged frames without an error.
  void log() {
    if (const Status whole = check_wal(file_); !whole)
      report_.add(whole.error().where, whole.error().what, whole.error().hint);
  }

  /// SQLite's own check of pages, rows and indices.
  void structure() {
    const Status done =
        database_.each("PRAGMA integrity_check(10)", [&](const sqlite::Statement& row) {
          if (const std::string line = row.text(0); line != "ok") found("structure", line);
        });
    if (!done) found("structure", done.error());
  }

  void progress() {
    const auto progress = load_progress(file_);
    if (!progress) return found("table campaign", progress.error());
    report_.planned = progress->planned;
    report_.finished = progress->finished;
  }

  void chunks() {
    bool stopped = false;
    const auto check = [&](const sqlite::Statement& row) -> Status {
      stopped = stop_requested_ && stop_requested_();
      if (stopped) return pass(stopped_early("chunks"));
      const std::int64_t stream = row.integer(3);
      report_.lost_samples += static_cast<std::uint64_t>(std::max<std::int64_t>(row.integer(7), 0));
      if (row.is_null(0))
        found("table chunk", "chunk without trial");
      else if (stream < 0 || stream >= std::int64_t{stream_count})
        found(place(row), "unknown stream");
      else if (crc32(row.blob(6)) != row.integer(5))
        found(place(row), "altered, CRC-32 differs");
      return {};
    };
    const Status done = database_.each(
        "SELECT trial.plan_index, trial.attempt, trial.label, stream, number, crc32, data, "
        "lost_before FROM chunk LEFT JOIN trial ON trial.id = chunk.trial "
        "ORDER BY chunk.trial, stream, number",
        check);
    if (!done) found(stopped ? "" : "table chunk", done.error());
  }

  static std::string place(const sqlite::Statement& row) {
    const std::int64_t stream = row.integer(3);
    const bool known = stream >= 0 && stream < std::int64_t{stream_count};
    return "trial " + row.text(0) + " (" + row.text(2) + ", attempt " + row.text(1) + "), " +
           (known ? std::string(to_string(static_cast<Stream>(stream))) : row.text(3)) + " chunk " +
           row.text(4);
  }

  void tables() {
    const auto digests = table_digests(database_);
    if (!digests) return found("table", digests.error());
    if (certificate_ == nullptr) return;
    for (std::size_t i = 0; i < certificate_->tables.size() && i < digests->size(); ++i)
      if ((*digests)[i] != certificate_->tables[i])
        found("table " + certificate_->tables[i].name, "row differs from the certificate");
  }

  /// `readable`: no damaged chunk was found, so a failed digest is additional information.
  void trials(bool readable) {
    const auto catalogue = catalogued_trials(database_);
    if (!catalogue) return found("table trial", catalogue.error());
    if (certificate_ != nullptr) compare_catalogue(*catalogue);
    const std::map<std::string, std::string> certified = certified_trials();
    std::size_t attempts = 0, complete = 0;
    std::vector<std::pair<std::string, const char*>> differences;  // trial, problem
    const auto compare = [&](const DatasetInfo&, const TrialData& attempt) -> Status {
      ++attempts;
      complete += is_done(attempt.record.outcome) ? 1 : 0;
      if (certificate_ == nullptr) return {};
      const auto known = certified.find(attempt.trial.file);
      if (known == certified.end())
        differences.emplace_back(attempt.trial.file, "not in the certificate");
      else if (known->second != trial_sha256(attempt.trial, attempt.record))
        differences.emplace_back(attempt.trial.file, "altered, SHA-256 differs");
      return {};
    };
    const auto info = visit_attempts(file_, Attempts::all, compare, stop_requested_);
    if (!info && !readable) return;  // reported already
    if (!info) return found("content", info.error());
    check_documents(*info, file_.filename().string() + ": table campaign", report_);
    report_.attempts = attempts;
    report_.complete = complete;
    report_.software_version = info->software_version;
    for (const auto& [trial, problem] : differences) found("trial " + trial, problem);
  }

  void compare_catalogue(const std::vector<CataloguedTrial>& catalogue) {
    const auto& recorded = certificate_->trials;
    if (catalogue.size() != recorded.size())
      return found("table trial",
                   "number of attempts differs: " + std::to_string(catalogue.size()) +
                       " (expected " + std::to_string(recorded.size()) + ")");
    for (std::size_t i = 0; i < recorded.size(); ++i)
      if (catalogue[i].sha256 != recorded[i].catalogue_sha256)
        found("trial " + recorded[i].name,
              "row of the trial or of a chunk differs from the certificate");
  }

  /// Digests of the trials in the certificate, by name.
  [[nodiscard]] std::map<std::string, std::string> certified_trials() const {
    std::map<std::string, std::string> out;
    if (certificate_ == nullptr) return out;
    for (const CertifiedTrial& trial : certificate_->trials) out[trial.name] = trial.sha256;
    return out;
  }

  const std::filesystem::path& file_;
  const Certificate* certificate_;
  const StopRequested& stop_requested_;
  VerifyReport& report_;
  sqlite::Database database_;
  std::optional<Error> busy_;
};

bool there(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

const FileChecksums* certified_file(const Certificate& certificate, const fs::path& file) {
  const auto found =
      std::ranges::find(certificate.files, file.filename().string(), &FileChecksums::name);
  return found == certificate.files.end() ? nullptr : &*found;
}

void compare_bytes(const FileChecksums& then, const fs::path& file,
                   const StopRequested& stop_requested, VerifyReport& report) {
  const auto now = file_checksums(file, stop_requested);
  const std::string name = file.filename().string();
  if (!now) return report.add(name, to_string(now.error()));
  if (now->bytes != then.bytes)
    report.add(name, "size differs: " + std::to_string(now->bytes) + " bytes (expected " +
                         std::to_string(then.bytes) + " bytes)");
  else if (now->sha256 != then.sha256)
    report.add(name, "altered, SHA-256 differs");
}

/// Content that this build cannot read, such as a missing filter, is not damage; nor is a file that
/// another program has locked.
Status found_if_damage(const Error& error, const fs::path& file, VerifyReport& report) {
  if (error.code == Errc::unsupported || error.code == Errc::busy) return pass(error);
  report.add(file.filename().string(), to_string(error));
  return {};
}

/// Sound and vibration: a data set with another layout and its own digest.
Status check_recordings(const fs::path& file, VerifyReport& report) {
  const auto set = read_recordings(file);
  if (!set) return found_if_damage(set.error(), file, report);
  report.dataset_sha256 = recordings_sha256(*set);
  report.planned = report.complete = report.attempts = set->recordings.size();
  report.of = "recordings";
  return {};
}

Status check_dataset(const fs::path& file, const Certificate* certificate, VerifyReport& report) {
  if (certificate == nullptr && is_recordings_file(file)) return check_recordings(file, report);
  const auto dataset = check_hdf5(file);
  const std::string name = file.filename().string();
  if (!dataset) return found_if_damage(dataset.error(), file, report);
  const Dataset& listed = dataset->listed;
  report.dataset_sha256 = dataset->digest.dataset_sha256;
  report.software_version = listed.info.software_version;
  check_documents(listed.info, name + ": /provenance", report);
  if (report.campaign.empty())
    report.planned = report.complete = report.attempts = listed.trials.size();
  if (certificate == nullptr || certificate->dataset_sha256 == report.dataset_sha256) return {};
  report.add(name, "data set differs from the certificate: " + report.dataset_sha256 +
                       " (expected " + certificate->dataset_sha256 + ")");
  return {};
}

/// Finds the files below `path` that can be checked.
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
                   .what = "folder has neither campaign.sqlite nor dataset.h5"});
    return report;
  }
  if (!there(path) && !has_log(path))
    return fail(
        {.code = Errc::not_found, .where = path.string(), .what = "no such file or folder"});
  // A campaign file with lost first bytes is still recognised by its name.
  const bool campaign = is_campaign_file(path) || path.filename() == campaign_file_name;
  (campaign ? report.campaign : report.dataset) = path;
  return report;
}

/// Everything in the certificate exists, and every existing file is in the certificate.
bool is_as_listed(const Certificate& certificate, const fs::path& folder, VerifyReport& report) {
  const std::size_t before = report.found_problems.size();
  for (const FileChecksums& file : certificate.files)
    if (!there(folder / file.name)) report.add(file.name, "missing, but in the certificate");
  for (const fs::path& file : {report.campaign, report.dataset})
    if (!file.empty() && certified_file(certificate, file) == nullptr)
      report.add(file.filename().string(), "not in the certificate");
  return report.found_problems.size() == before;
}

Status check_file(const fs::path& file, const Certificate* certificate,
                  const StopRequested& stop_requested, VerifyReport& report) {
  const FileChecksums* then = certificate == nullptr ? nullptr : certified_file(*certificate, file);
  const bool is_campaign = file == report.campaign;
  if (then != nullptr) compare_bytes(*then, file, stop_requested, report);
  // A certificate is made of a finished file, so its log must be empty.
  if (is_campaign && then != nullptr && has_log(file))
    report.add(file.filename().string(), "written after it was certified, its log is not empty");
  // A process killed before its first write leaves a file in which nothing can be wrong.
  report.blank |= is_campaign && is_blank_campaign(file);
  if (report.blank && certificate == nullptr && report.dataset.empty()) return {};
  if (!is_campaign) return check_dataset(file, then == nullptr ? nullptr : certificate, report);
  return CampaignCheck(file, then == nullptr ? nullptr : certificate, stop_requested, report).run();
}

}  // namespace

Result<VerifyReport> verify(const fs::path& path, const StopRequested& stop_requested) {
  auto report = inspect(path);
  if (!report) return report;
  const fs::path& file = report->campaign.empty() ? report->dataset : report->campaign;
  const auto read = read_certificate(file.parent_path());
  const Certificate* certificate = nullptr;
  if (!read)
    report->add(certificate_file_name, to_string(read.error()));
  else if (*read)
    certificate = &**read;
  std::error_code ignored;
  if (certificate != nullptr)
    report->certified = fs::is_directory(path, ignored)
                            ? is_as_listed(*certificate, path, *report)
                            : certified_file(*certificate, file) != nullptr;
  for (const fs::path& each : {report->campaign, report->dataset})
    if (!each.empty())
      if (auto done = check_file(each, certificate, stop_requested, *report); !done)
        return pass(done.error());
  if (fs::is_directory(path, ignored)) {
    check_handover(path, certificate == nullptr ? "" : certificate->dataset_sha256, *report);
    check_exports(path, stop_requested, *report);
  }
  if (stop_requested && stop_requested()) return pass(stopped_early(path.string()));
  return report;
}

nlohmann::json exports_json(const std::vector<CheckedExport>& exports) {
  nlohmann::json out = nlohmann::json::array();
  for (const CheckedExport& one : exports)
    out.push_back({{"name", one.name},
                   {"state", to_string(one.state)},
                   {"trials", one.trials},
                   {"trials_done", one.done},
                   {"trials_done_now", one.done_now}});
  return out;
}

nlohmann::json verify_json(const VerifyReport& report) {
  nlohmann::json found_problems = nlohmann::json::array();
  for (const VerifyProblem& problem : report.found_problems)
    found_problems.push_back(
        {{"where", problem.where}, {"what", problem.what}, {"hint", problem.hint}});
  return {{"holds", report.holds()},
          {"certified", report.certified},
          {"finished", report.finished},
          {"blank", report.blank},
          {"trials_planned", report.planned},
          {"trials_complete", report.complete},
          {"attempts", report.attempts},
          {"lost_samples", report.lost_samples},
          {"dataset_sha256", report.dataset_sha256},
          {"software_version", report.software_version},
          {"exports", exports_json(report.exports)},
          {"findings", std::move(found_problems)}};
}

}  // namespace weft::daemon
