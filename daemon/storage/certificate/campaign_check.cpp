#include "daemon/storage/certificate/campaign_check.hpp"

#include <algorithm>
#include <map>
#include <utility>

#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/certificate/catalogue_digest.hpp"
#include "daemon/storage/recorder/campaign_history.hpp"
#include "daemon/storage/recorder/chunk.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "daemon/storage/recorder/wal_integrity.hpp"
#include "protocols/base/crc.hpp"

namespace weft::daemon {
namespace {

constexpr std::size_t most_structure_lines = 10;

class CampaignCheck {
 public:
  CampaignCheck(const std::filesystem::path& file, const Certificate* certificate,
                const StopRequested& stop_requested, VerifyReport& report)
      : file_(file), certificate_(certificate), stop_requested_(stop_requested), report_(report) {}

  void run() {
    log();
    auto opened = sqlite::Database::open(file_, sqlite::Mode::read_only);
    if (!opened) return found({}, opened.error());
    database_ = std::move(*opened);
    structure();
    progress();
    const std::size_t before = report_.found_problems.size();
    chunks();
    tables();
    trials(report_.found_problems.size() == before);
  }

 private:
  void found(const std::string& where, std::string what, std::string hint = {}) {
    const std::string name = file_.filename().string();
    report_.found_problems.push_back(
        {where.empty() ? name : name + ": " + where, std::move(what), std::move(hint)});
  }
  void found(const std::string& where, Error error) {
    std::string hint = std::exchange(error.hint, {});
    found(where, to_string(error), std::move(hint));
  }

  /// Before SQLite opens the file: it says nothing of what it leaves out.
  void log() {
    if (const Status whole = check_wal(file_); !whole)
      report_.found_problems.push_back(
          {whole.error().where, whole.error().what, whole.error().hint});
  }

  /// SQLite's own look at pages, rows and indices.
  void structure() {
    auto query = database_.prepare("PRAGMA integrity_check(10)");
    if (!query) return found("structure", query.error());
    for (std::size_t i = 0; i < most_structure_lines; ++i) {
      const auto row = query->step();
      if (!row) return found("structure", row.error());
      if (!*row) return;
      if (const std::string line = query->text(0); line != "ok") found("structure", line);
    }
  }

  void progress() {
    const auto progress = load_progress(file_);
    if (!progress) return found("table campaign", progress.error());
    report_.planned = progress->planned;
    report_.finished = progress->finished;
  }

  void chunks() {
    auto query = database_.prepare(
        "SELECT trial.plan_index, trial.attempt, trial.label, stream, number, crc32, data, "
        "lost_before FROM chunk LEFT JOIN trial ON trial.id = chunk.trial "
        "ORDER BY chunk.trial, stream, number");
    if (!query) return found("table chunk", query.error());
    while (true) {
      const auto row = query->step();
      if (!row) return found("table chunk", row.error());
      if (!*row) return;
      if (stop_requested_ && stop_requested_()) return found({}, stopped_early("chunks"));
      const std::int64_t stream = query->integer(3);
      report_.lost_samples +=
          static_cast<std::uint64_t>(std::max<std::int64_t>(query->integer(7), 0));
      if (query->is_null(0))
        found("table chunk", "a chunk belongs to no trial");
      else if (stream < 0 || stream >= std::int64_t{stream_count})
        found(place(*query), "a stream that there is not");
      else if (crc32(query->blob(6)) != query->integer(5))
        found(place(*query), "altered: its CRC-32 disagrees");
    }
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
        found("table " + certificate_->tables[i].name, "a row is not as it was certified");
  }

  /// `readable`: no chunk was found damaged, so that a digest says something more.
  void trials(bool readable) {
    const auto catalogue = catalogued_trials(database_);
    if (!catalogue) return found("table trial", catalogue.error());
    if (certificate_ != nullptr) compare_catalogue(*catalogue);
    auto all = load_campaign(file_, {.all_outcomes = true,
                                     .streams = true,
                                     .transfers = false,
                                     .stop_requested = stop_requested_});
    if (!all && !readable) return;  // told already
    if (!all) return found("content", all.error());
    check_documents(all->info, file_.filename().string() + ": table campaign", report_);
    report_.attempts = all->trials.size();
    report_.complete =
        static_cast<std::size_t>(std::count_if(all->records.begin(), all->records.end(),
                                               [](const auto& r) { return is_done(r.outcome); }));
    report_.software_version = all->info.software_version;
    if (certificate_ != nullptr) compare_content(*all);
  }

  void compare_catalogue(const std::vector<CataloguedTrial>& catalogue) {
    const auto& recorded = certificate_->trials;
    if (catalogue.size() != recorded.size())
      return found("table trial", std::to_string(catalogue.size()) + " attempts, certified were " +
                                      std::to_string(recorded.size()));
    for (std::size_t i = 0; i < recorded.size(); ++i)
      if (catalogue[i].sha256 != recorded[i].catalogue_sha256)
        found("trial " + recorded[i].name,
              "its row or its chunks' rows are not as they were certified");
  }

  void compare_content(const Dataset& all) {
    std::map<std::string, std::string> recorded;
    for (const CertifiedTrial& trial : certificate_->trials) recorded[trial.name] = trial.sha256;
    for (std::size_t i = 0; i < all.trials.size(); ++i) {
      const auto known = recorded.find(all.trials[i].file);
      if (known == recorded.end())
        found("trial " + all.trials[i].file, "is not in the certificate");
      else if (known->second != trial_sha256(all.trials[i], all.records[i]))
        found("trial " + all.trials[i].file, "altered: its SHA-256 disagrees");
    }
  }

  const std::filesystem::path& file_;
  const Certificate* certificate_;
  const StopRequested& stop_requested_;
  VerifyReport& report_;
  sqlite::Database database_;
};

}  // namespace

void check_campaign(const std::filesystem::path& file, const Certificate* certificate,
                    const StopRequested& stop_requested, VerifyReport& report) {
  CampaignCheck(file, certificate, stop_requested, report).run();
}

void check_documents(const DatasetInfo& info, const std::string& where, VerifyReport& report) {
  const auto same = [&](const char* what, const std::string& text, const std::string& recorded) {
    if (!text.empty() && sha256_hex(text) != recorded)
      report.found_problems.push_back({where, std::string(what) + " does not have its SHA-256"});
  };
  same("the recipe", info.recipe_json, info.recipe_sha256);
  same("the rig", info.rig_json, info.rig_sha256);
}

}  // namespace weft::daemon
