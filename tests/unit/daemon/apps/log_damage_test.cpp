// A killed campaign with a damaged or lost write-ahead log: the damage is reported, and no file is
// removed. SIMULATED.

#include <catch2/catch.hpp>

#include "daemon/apps/weft/dataset_file.hpp"
#include "daemon/campaign/resume.hpp"
#include "daemon/storage/certificate/exports.hpp"
#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/recorder/sqlite.hpp"
#include "tests/unit/daemon/benches/kill_points.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace log_damage_test {

using namespace weft;
using namespace weft::daemon;
using test::killed_at;
using test::KillPoint;
using test::TemporaryFolder;

namespace {

namespace fs = std::filesystem;

/// Every file of a folder with its content.
std::map<std::string, std::string> contents_of(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.path().extension() != ".sqlite-shm")  // shared memory of SQLite, created by reading
      files[entry.path().filename().string()] = test::read_file(entry.path());
  return files;
}

/// A killed campaign with some recorded trials, most of them only in its log.
struct KilledCampaign {
  TemporaryFolder folder;
  CampaignRequest request = test::request_in(folder, test::tiny_recipe(2));
  fs::path file = request.out / "campaign.sqlite", log = request.out / "campaign.sqlite-wal";

  explicit KilledCampaign(std::uint64_t write = 120) {
    request.error_check = false;
    REQUIRE(killed_at(request, {write, false}) == true);
    fs::remove(request.out / "campaign.sqlite-shm");
  }

  VerifyReport verified() const {
    const auto report = verify(request.out);
    if (!report) FAIL(to_string(report.error()));
    return *report;
  }

  /// `weft verify` reports it twice, a resume is refused, and every byte stays.
  void check_refused(const std::string& where) {
    const auto before = contents_of(request.out);
    for (int i = 0; i < 2; ++i) {
      const VerifyReport report = verified();
      REQUIRE_FALSE(report.holds());
      INFO(report.found_problems.front().where << ": " << report.found_problems.front().what);
      CHECK(report.found_problems.front().where.find(where) != std::string::npos);
    }
    request.resume = true;
    CHECK_FALSE(preview_resume(request));
    const auto ran = run_campaign(request, {});
    REQUIRE_FALSE(ran);
    CHECK(ran.error().code == Errc::corrupt);
    CHECK_FALSE(ran.error().hint.empty());
    CHECK(contents_of(request.out) == before);
  }
};

}  // namespace

TEST_CASE("a flipped bit in the log of a killed campaign is found, and a resume keeps all of it") {
  KilledCampaign killed;
  REQUIRE(killed.verified().holds());
  const std::size_t complete = killed.verified().complete;
  REQUIRE(complete >= 2);
  const std::string whole = test::read_file(killed.log);
  constexpr std::size_t frame = 24 + 16384, header = 32;
  std::size_t last = whole.size() - whole.size() % frame + header - 2 * frame;
  while (whole.substr(last + 4, 4) == std::string(4, '\0')) last -= frame;
  std::size_t bit = 1, looked_at = 0;
  for (std::size_t at = 5; at < last; at += 1 + whole.size() / 41) {
    std::string bent = whole;
    bent[at] = static_cast<char>(bent[at] ^ 1 << bit);
    bit = (bit + 3) % 8;
    test::write_file(killed.log, bent);
    fs::remove(killed.request.out / "campaign.sqlite-shm");
    INFO("byte " << at << " of " << whole.size());
    if (looked_at++ % 8 == 0) {
      killed.check_refused("campaign.sqlite-wal: byte ");
    } else {
      CHECK_FALSE(killed.verified().holds());
    }
  }
  CHECK(looked_at > 20);
  test::write_file(killed.log, whole);
  fs::remove(killed.request.out / "campaign.sqlite-shm");
  CHECK(killed.verified().complete == complete);
  killed.request.resume = true;
  REQUIRE(run_campaign(killed.request, {}));
  CHECK(killed.verified().certified);
}

TEST_CASE("a campaign resumes with the data before the damage once its log is checkpointed") {
  KilledCampaign killed;
  std::string bent = test::read_file(killed.log);
  bent[bent.size() / 2] = static_cast<char>(bent[bent.size() / 2] ^ 1);
  test::write_file(killed.log, bent);
  const auto report = killed.verified();
  REQUIRE_FALSE(report.holds());
  CHECK(report.found_problems.front().hint.find("PRAGMA wal_checkpoint(TRUNCATE)") !=
        std::string::npos);
  {
    auto file = sqlite::Database::open(killed.file, sqlite::Mode::read_write);
    REQUIRE(file);
    REQUIRE(file->execute("PRAGMA wal_checkpoint(TRUNCATE)"));
  }
  CHECK(killed.verified().holds());
  killed.request.resume = true;
  const auto summary = run_campaign(killed.request, {});
  REQUIRE(summary);
  CHECK(summary->trials_complete == 4);
  CHECK(killed.verified().certified);
}

TEST_CASE("a killed campaign without its log is one that has lost it") {
  KilledCampaign killed;
  fs::remove(killed.log);
  killed.check_refused("campaign.sqlite-wal");
  test::write_file(killed.log, "");
  killed.check_refused("campaign.sqlite-wal");
}

TEST_CASE("a campaign that has lost some of its log is exported only on request") {
  KilledCampaign killed;
  const std::size_t complete = cli::open_campaign(killed.file)->dataset.trials.size();
  REQUIRE(complete == killed.verified().complete);
  std::string log = test::read_file(killed.log);
  SECTION("the log is gone") {
    fs::remove(killed.log);
  }
  SECTION("the log is damaged") {
    log[log.size() / 3] = static_cast<char>(log[log.size() / 3] ^ 1);
    test::write_file(killed.log, log);
  }
  fs::remove(killed.request.out / "campaign.sqlite-shm");
  const auto refused = cli::open_campaign(killed.file);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::corrupt);
  CHECK(refused.error().where.find("campaign.sqlite-wal") != std::string::npos);
  const auto exported = export_campaign(killed.request.out, {});
  REQUIRE_FALSE(exported);
  CHECK(exported.error().code == refused.error().code);
  CHECK(exported.error().what == refused.error().what);
  const auto rest = cli::open_campaign(killed.file, cli::CampaignLog::as_far_as_it_goes);
  CHECK((!rest || rest->dataset.trials.size() < complete));
}

TEST_CASE("a log without its campaign file is no empty folder") {
  KilledCampaign killed;
  test::write_file(killed.file, "");
  killed.check_refused("campaign.sqlite");
  fs::remove(killed.file);
  killed.check_refused("campaign.sqlite");
}

TEST_CASE("what a resume does not continue is set aside and not removed") {
  bool seen_blank = false, seen_begun = false;
  for (std::uint64_t write = 1; !seen_begun; ++write) {
    KilledCampaign killed(write);
    if (!fs::exists(killed.file)) continue;
    const bool blank = killed.verified().blank;
    if (blank && seen_blank) continue;
    (blank ? seen_blank : seen_begun) = true;
    killed.request.resume = true;
    const auto preview = preview_resume(killed.request);
    REQUIRE(preview);
    CHECK(preview->will.front().find("campaign.aside-1.sqlite") != std::string::npos);
    const auto summary = run_campaign(killed.request, {});
    REQUIRE(summary);
    CHECK(summary->trials_complete == 4);
    CHECK(killed.verified().certified);
    CHECK(fs::exists(killed.request.out / "campaign.aside-1.sqlite"));
    const auto journal = load_journal(killed.file);
    REQUIRE(journal);
    CHECK(std::any_of(journal->begin(), journal->end(),
                      [](const JournalEntry& line) { return line.kind == "set_aside"; }));
  }
  CHECK(seen_blank);
}

}  // namespace log_damage_test
