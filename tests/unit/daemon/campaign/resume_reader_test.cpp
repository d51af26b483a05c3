// A campaign is resumed while another program reads its file, or after one read it at its end: no
// data are lost. SIMULATED.

#include <csignal>

#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/recorder/sqlite.hpp"
#include "tests/unit/daemon/benches/resumed_campaign.hpp"

namespace resume_reader_test {

using namespace weft;
using namespace weft::daemon;
using test::check_holds;
using test::check_whole;
using test::killed_at;
using test::request_for;
using test::resumed;
using test::run;
using test::stopped_after_two;
using test::TemporaryFolder;

namespace {

/// Stopped after two trials and certified while another program has the file open: its header names
/// a log, which is empty. `old`: made before the table log_expected existed.
std::filesystem::path certified_beside_a_reader(const CampaignRequest& request, bool old) {
  CampaignHooks hooks;
  std::atomic<bool> stop = false;
  std::optional<sqlite::Database> reader;
  hooks.stop = &stop;
  hooks.progress = [&](const TrialProgress& line) {
    stop = line.done == 2;
    if (reader) return;
    auto opened = sqlite::Database::open(request.out / "campaign.sqlite", sqlite::Mode::read_only);
    REQUIRE(opened);
    reader = std::move(*opened);
    REQUIRE(reader->prepare("SELECT count(*) FROM trial")->step());
  };
  const CampaignSummary summary = run(request, hooks);
  constexpr std::size_t write_version_at = 18;
  CHECK(test::read_file(summary.campaign_file)[write_version_at] == 2);  // a write-ahead log
  if (!old) return summary.campaign_file;
  REQUIRE(sqlite::Database::open(summary.campaign_file, sqlite::Mode::read_write)
              ->execute("DROP TABLE log_expected; PRAGMA wal_checkpoint(TRUNCATE)"));
  REQUIRE(write_certificate(summary.campaign_file, summary.dataset_file));
  return summary.campaign_file;
}

}  // namespace

TEST_CASE("a resume that ends in its replay leaves a campaign that was read at its end certified") {
  const bool from_before_logs_were_expected = GENERATE(false, true);
  const bool killed = GENERATE(false, true);
  CAPTURE(from_before_logs_were_expected, killed);
  const TemporaryFolder folder;
  CampaignRequest request = request_for(folder);
  const auto file = certified_beside_a_reader(request, from_before_logs_were_expected);
  const std::string before = test::read_file(file);
  check_holds(request.out);
  request.resume = true;
  CampaignHooks hooks;
  std::atomic<bool> stop = false;
  hooks.stop = &stop;
  hooks.progress = [&](const TrialProgress& line) {
    if (line.done != 1) return;
    if (killed) raise(SIGKILL);
    stop = true;
  };
  if (killed)
    REQUIRE(killed_at(request, {}, hooks) == true);
  else
    static_cast<void>(run_campaign(request, hooks));
  CHECK((test::read_file(file) == before));
  check_holds(request.out);
  CHECK(verify(request.out)->certified);
  resumed(request);
  check_whole(request.out, 1);
}

TEST_CASE("a resume beside a process that reads the file without a pause changes nothing") {
  const TemporaryFolder folder;
  CampaignRequest request = request_for(folder);
  const auto file = stopped_after_two(request).campaign_file;
  const std::string before = test::read_file(file);
  request.resume = true;
  {
    auto reader = sqlite::Database::open(file, sqlite::Mode::read_only);
    REQUIRE(reader);
    auto chunks = reader->prepare("SELECT data FROM chunk");
    REQUIRE(chunks);
    REQUIRE(chunks->step());
    const auto played = run_campaign(request, {});
    REQUIRE(played);
    CHECK(played->outcome == recipes::Outcome::failed);
    CHECK(played->rig == recipes::RigFact::safe);
    REQUIRE(played->dataset_error);
    CHECK(to_string(*played->dataset_error).find("locked") != std::string::npos);
  }
  CHECK((test::read_file(file) == before));
  CHECK(verify(request.out)->certified);
  check_holds(request.out);
  resumed(request);
  check_whole(request.out, 1);
}

}  // namespace resume_reader_test
