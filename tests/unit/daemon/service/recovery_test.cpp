// Recovery of an interrupted run: it is discarded, or kept with its complete trials. SIMULATED.

#include "daemon/campaign/resume.hpp"

#include <catch2/catch.hpp>

#include "daemon/storage/certificate/verify.hpp"
#include "daemon/storage/dataset/hdf5_file.hpp"
#include "daemon/storage/recorder/campaign_folder.hpp"
#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace recovery_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using test::leave_interrupted;
using test::RunManagerBench;
using test::TemporaryFolder;

namespace {

std::string only_run(const RunManagerBench& bench) {
  return bench.manager->loaded().front().stored.id();
}

Result<ResumePreview> previewed(RunManagerBench& bench, Recovery choice) {
  std::optional<Result<ResumePreview>> reported;
  bench.manager->preview(only_run(bench), choice,
                         [&](const Result<ResumePreview>& left) { reported = left; });
  REQUIRE(bench.posted.run_until([&] { return reported.has_value(); }));
  return *reported;
}

Result<RunView> settled(RunManagerBench& bench, Recovery choice) {
  std::optional<Result<RunView>> reported;
  bench.manager->settle(only_run(bench), choice, "ada",
                        [&](const Result<RunView>& run) { reported = run; });
  REQUIRE(bench.posted.run_until([&] { return reported.has_value(); }));
  return *reported;
}

}  // namespace

TEST_CASE("a discarded run has ended, its file is marked, and no data set is made") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  RunManagerBench bench(folder);
  const auto left = previewed(bench, Recovery::discard);
  REQUIRE(left);
  CHECK(left->planned == 4);
  CHECK(left->complete >= 2);
  CHECK(bench.manager->get(only_run(bench))->machine.state == RunState::interrupted);
  const auto run = settled(bench, Recovery::discard);
  REQUIRE(run);
  CHECK(run->machine.state == RunState::ended);
  CHECK(run->stored.outcome == "aborted");
  CHECK(run->stored.recovered == "discard");
  CHECK(run->stored.error.empty());
  const auto campaign = run->stored.folder / "campaign.sqlite";
  CHECK(load_campaign(campaign).error().code == Errc::wrong_state);
  CHECK(load_campaign(campaign, {.all_outcomes = true})->trials.size() >= left->complete);
  CHECK(load_progress(campaign)->discarded);
  const auto report = verify(run->stored.folder);
  REQUIRE(report);
  CHECK(report->certified);
  CHECK(report->holds());
  CHECK_FALSE(bench.recover(only_run(bench), "ada"));
  CHECK(bench.manager->rig_state() == RigState{RigFact::unknown, only_run(bench)});
  CampaignRequest request = bench.request;
  request.out = run->stored.folder;
  request.resume = true;
  const auto refused = preview_resume(request);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::wrong_state);
  CHECK_THAT(refused.error().what, Catch::Contains("discarded"));
}

TEST_CASE("the complete trials of an interrupted run are kept, certified and marked partial") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  RunManagerBench bench(folder);
  const auto left = previewed(bench, Recovery::keep_partial);
  REQUIRE(left);
  const auto run = settled(bench, Recovery::keep_partial);
  REQUIRE(run);
  CHECK(run->machine.state == RunState::ended);
  CHECK(run->stored.outcome == "interrupted");
  CHECK(run->stored.recovered == "keep-partial");
  CHECK(run->trials_done == left->complete);
  CHECK(run->trials_planned == 4);
  const auto dataset = read_hdf5(run->stored.folder / "dataset.h5");
  REQUIRE(dataset);
  CHECK(dataset->trials.size() == left->complete);
  CHECK(dataset_sha256(*dataset) == run->stored.dataset_sha256);
  const auto report = verify(run->stored.folder);
  REQUIRE(report);
  CHECK(report->certified);
  CHECK(report->holds());
  CHECK(report->planned == 4);
  CHECK(report->complete == left->complete);
  const auto journal = load_journal(run->stored.folder / "campaign.sqlite");
  CHECK(journal->back().kind == "kept_partial");
  CHECK(journal->back().payload_json.find("ada") != std::string::npos);
}

TEST_CASE("what was decided about a run outlives the daemon") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  {
    RunManagerBench bench(folder);
    REQUIRE(settled(bench, Recovery::keep_partial));
  }
  RunManagerBench bench(folder);
  const RunView run = bench.manager->loaded().front();
  CHECK(run.machine.state == RunState::ended);
  CHECK(run.stored.recovered == "keep-partial");
}

TEST_CASE("nothing is kept where no trial is complete, and the run is interrupted as before") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  std::filesystem::remove(folder / "R-000001" / "campaign.sqlite-wal");
  std::filesystem::remove(folder / "R-000001" / "campaign.sqlite");
  RunManagerBench bench(folder);
  CHECK(previewed(bench, Recovery::keep_partial).error().code == Errc::not_found);
  const auto refused = settled(bench, Recovery::keep_partial);
  REQUIRE_FALSE(refused);
  CHECK(bench.manager->get(only_run(bench))->machine.state == RunState::interrupted);
  const auto run = settled(bench, Recovery::discard);
  REQUIRE(run);
  CHECK(run->stored.outcome == "aborted");
}

TEST_CASE("nothing is settled while the daemon's folder is away, or where it went meanwhile") {
  const TemporaryFolder folder;
  const std::filesystem::path away = folder.path().string() + "-away";
  leave_interrupted(folder);
  RunManagerBench bench(folder);
  const auto campaign = folder / "R-000001" / "campaign.sqlite";
  std::filesystem::rename(folder.path(), away);
  CHECK(settled(bench, Recovery::discard).error().code == Errc::io);
  std::filesystem::rename(away, folder.path());
  CHECK_FALSE(load_progress(campaign)->discarded);
  std::optional<Result<RunView>> reported;
  bench.manager->settle(only_run(bench), Recovery::discard, "ada",
                        [&](const Result<RunView>& run) { reported = run; });
  REQUIRE(bench.posted.arrives());
  std::filesystem::rename(folder.path(), away);
  REQUIRE(bench.posted.run_until([&] { return reported.has_value(); }));
  CHECK(reported->error().code == Errc::io);
  CHECK(bench.manager->get(only_run(bench))->machine.state == RunState::interrupted);
  std::filesystem::rename(away, folder.path());
  REQUIRE(settled(bench, Recovery::discard));
  CHECK(load_progress(campaign)->discarded);
}

TEST_CASE("while one choice is carried out no other is, and each preview is of its own choice") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  RunManagerBench bench(folder);
  const std::string id = only_run(bench);
  std::vector<ResumePreview> reported;
  const auto tell = [&](const Result<ResumePreview>& left) { reported.push_back(left.value()); };
  bench.manager->preview(id, Recovery::resume, tell);
  bench.manager->preview(id, Recovery::discard, tell);
  bench.manager->preview(id, Recovery::resume, tell);
  REQUIRE(bench.posted.run_until([&] { return reported.size() == 3; }));
  CHECK(reported[0].will == reported[1].will);
  CHECK(reported[2].will != reported[0].will);
  bench.posted.hold();
  std::optional<RunView> ended;
  bench.manager->settle(id, Recovery::discard, "ada",
                        [&](const Result<RunView>& run) { ended = run.value(); });
  CHECK(bench.recover(id, "ada").error().code == Errc::wrong_state);
  std::optional<Error> refused;
  bench.manager->settle(id, Recovery::keep_partial, "ada",
                        [&](const Result<RunView>& run) { refused = run.error(); });
  CHECK(refused.has_value());
  bench.posted.let_go();
  REQUIRE(bench.posted.run_until([&] { return ended.has_value(); }));
  CHECK(ended->stored.outcome == "aborted");
}

TEST_CASE("a damaged file does not keep its run from being discarded, a busy one does") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  const auto campaign = folder / "R-000001" / "campaign.sqlite";
  RunManagerBench bench(folder);
  {
    const auto lock = FolderLock::take(folder / "R-000001");
    REQUIRE(lock);
    CHECK(settled(bench, Recovery::discard).error().code == Errc::busy);
    CHECK(bench.manager->get(only_run(bench))->machine.state == RunState::interrupted);
  }
  std::filesystem::remove(folder / "R-000001" / "campaign.sqlite-wal");
  test::write_file(campaign, "SQLite format 3" + std::string(5000, 'x'));
  const auto run = settled(bench, Recovery::discard);
  REQUIRE(run);
  CHECK(run->machine.state == RunState::ended);
  CHECK(run->stored.error.find("discarded") != std::string::npos);
  CHECK_FALSE(load_campaign(campaign));
}

TEST_CASE("a file that another run works in is not discarded under it") {
  const TemporaryFolder folder;
  leave_interrupted(folder);
  const auto lock = FolderLock::take(folder / "R-000001");
  REQUIRE(lock);
  CHECK(discard_campaign(folder / "R-000001", "ada").error().code == Errc::busy);
  CHECK_FALSE(load_progress(folder / "R-000001" / "campaign.sqlite")->discarded);
}

}  // namespace recovery_test
