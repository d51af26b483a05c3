// A lost or damaged database is rebuilt from the runs' folders, and a folder made by `weft run` is
// added. SIMULATED.

#include "daemon/service/run_store/catalogue.hpp"

#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/recorder/campaign_folder.hpp"
#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace catalogue_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using test::TemporaryFolder;
namespace fs = std::filesystem;

namespace {

constexpr std::int64_t now_us = 1'795'000'000'000'000;

CataloguePaths paths_in(const TemporaryFolder& folder) {
  return {folder.path(), folder / "rig.json", folder.path()};
}

/// A complete campaign as `weft run` makes it.
CampaignRequest campaign_in(const TemporaryFolder& folder, const fs::path& out) {
  CampaignRequest request = test::request_in(folder, test::tiny_recipe(1));
  request.error_check = false;
  request.out = out;
  const auto summary = run_campaign(request, {});
  if (!summary) FAIL(to_string(summary.error()));
  REQUIRE(summary->outcome == recipes::Outcome::complete);
  return request;
}

RunStore open_store(const TemporaryFolder& folder) {
  return std::move(RunStore::open(folder / store_file_name).value());
}

/// Removes the last page of the database.
std::string damage(const TemporaryFolder& folder) {
  const fs::path file = folder / store_file_name;
  fs::resize_file(file, fs::file_size(file) - 4096);
  return test::read_file(file);
}

}  // namespace

TEST_CASE("the number of a run's folder is read from its name") {
  CHECK(folder_number("/data/R-000012") == 12);
  CHECK(folder_number("/data/R-000012-first") == 12);
  CHECK(folder_number("R-1234567-2") == 1234567);
  for (const char* const other :
       {"R-12", "R-000000", "R-00012x", "R-", "X-000012", "R-0000012", ""})
    CHECK(folder_number(other) == 0);
  CHECK(run_number("R-000318") == 318);
  CHECK_FALSE(run_number("R-000318-first"));
}

TEST_CASE("a new catalogue gives no number of a folder again, and its rig is unknown") {
  const TemporaryFolder folder;
  fs::create_directories(folder / "R-000041-first");
  fs::create_directories(folder / "R-000007");
  RunStore store = open_store(folder);
  CHECK(store.next_number().value() == 42);
  CHECK_FALSE(store.rig_state()->can_move());
  REQUIRE(store.skip_numbers(50));
  CHECK(store.next_number().value() == 51);
  REQUIRE(store.skip_numbers(45));
  CHECK(store.next_number().value() == 51);
}

TEST_CASE("a catalogue that was lost is made again from the folders") {
  const TemporaryFolder folder;
  StoredRun before;
  {
    test::RunManagerBench bench(folder, test::tiny_recipe(1));
    before = bench.ended(bench.submit().stored.id()).stored;
    REQUIRE(before.outcome == "complete");
  }
  campaign_in(folder, folder / "mine");
  fs::remove(folder / store_file_name);
  const auto report = rebuild_catalogue(paths_in(folder), now_us);
  REQUIRE(report);
  CHECK(report->damaged.empty());
  CHECK(report->left_out.empty());
  CHECK(report->next_number == 3);
  RunStore store = open_store(folder);
  const auto runs = store.runs().value();
  REQUIRE(runs.size() == 2);
  const StoredRun& run = runs.front();
  CHECK(run.id() == before.id());
  CHECK(run.folder == before.folder);
  CHECK(run.state == RunState::ended);
  CHECK(run.outcome == "complete");
  CHECK(run.cleanup == "unknown");
  CHECK(run.rig_fact == "unknown");
  CHECK(run.dataset_sha256 == before.dataset_sha256);
  CHECK(run.trials_done == before.trials_done);
  CHECK(run.trials_planned == before.trials_planned);
  CHECK(run.recipe_sha256 == before.recipe_sha256);
  CHECK(sha256_hex(store.recipe_text(run.recipe_sha256).value()) == run.recipe_sha256);
  CHECK(run.recipe == before.recipe);
  CHECK(runs.back().number == 2);
  CHECK(runs.back().name == "mine");
  CHECK_FALSE(store.rig_state()->can_move());
  CHECK(store.queue()->runs().empty());
  CHECK(store.next_number().value() == 3);
}

TEST_CASE("a campaign that did not come to its end is interrupted in the new catalogue") {
  const TemporaryFolder folder;
  test::leave_interrupted(folder);
  fs::remove(folder / store_file_name);
  REQUIRE(rebuild_catalogue(paths_in(folder), now_us));
  const StoredRun run = open_store(folder).runs()->front();
  CHECK(run.id() == "R-000001");
  CHECK(run.state == RunState::interrupted);
  CHECK(run.outcome == "interrupted");
  CHECK(run.trials_done >= 2);
  CHECK(run.trials_planned == 4);
}

TEST_CASE("a damaged catalogue is kept aside, and only by the order to rebuild it") {
  const TemporaryFolder folder;
  campaign_in(folder, folder / "R-000003");
  { REQUIRE(open_store(folder).skip_numbers(40)); }
  const std::string bytes = damage(folder);
  const auto refused = RunStore::open(folder / store_file_name);
  REQUIRE_FALSE(refused);
  CHECK(is_damage(refused.error().code));
  CHECK(refused.error().where.find((folder / store_file_name).string()) != std::string::npos);
  CHECK(refused.error().hint.find("--rebuild-catalogue") != std::string::npos);
  CHECK(test::read_file(folder / store_file_name) == bytes);
  const auto report = rebuild_catalogue(paths_in(folder), now_us);
  REQUIRE(report);
  CHECK(report->damaged.filename() == "weftd.sqlite.damaged-20261118T110640Z");
  CHECK(test::read_file(report->damaged) == bytes);
  RunStore store = open_store(folder);
  REQUIRE(store.runs()->size() == 1);
  CHECK(store.runs()->front().number == 3);
  CHECK(store.next_number().value() == 41);  // the damaged file still has the used numbers
  CHECK_FALSE(store.rig_state()->can_move());
}

TEST_CASE("of two folders with one number the older has it, and the other gets a new one") {
  const TemporaryFolder folder;
  campaign_in(folder, folder / "R-000002-2");
  campaign_in(folder, folder / "R-000002");
  REQUIRE(rebuild_catalogue(paths_in(folder), now_us));
  const auto runs = open_store(folder).runs().value();
  REQUIRE(runs.size() == 2);
  CHECK(runs[0].number == 2);
  CHECK(runs[0].folder.filename() == "R-000002-2");
  CHECK(runs[1].number == 3);
}

TEST_CASE("a catalogue that can be read keeps what it has, and gets what it does not list") {
  const TemporaryFolder folder;
  campaign_in(folder, folder / "mine");
  StoredRun known;
  {
    RunStore store = open_store(folder);
    known.state = RunState::ended;
    known.outcome = "stopped";
    known.folder = folder / "R-000001";
    REQUIRE(test::add(store, known));
    REQUIRE(store.append_journal(1, "", "daemon.started", "auto:daemon"));
  }
  for (const std::size_t added : {1U, 0U}) {
    const auto report = rebuild_catalogue(paths_in(folder), now_us);
    REQUIRE(report);
    CHECK(report->added.size() == added);
    CHECK(report->next_number == 3);
  }
  RunStore store = open_store(folder);
  REQUIRE(store.runs()->size() == 2);
  CHECK(store.runs()->front().outcome == "stopped");
  CHECK(store.rig_state()->can_move());
}

TEST_CASE("a folder is added once, where it is, as a run that has ended") {
  const TemporaryFolder folder, elsewhere;
  const CataloguePaths paths = paths_in(folder);
  RunStore store = open_store(folder);
  campaign_in(folder, elsewhere / "R-000009");
  const auto found = load_found_run(elsewhere / "R-000009", paths);
  REQUIRE(found);
  const auto run = add_found_run(store, paths, *found, "ada", now_us);
  REQUIRE(run);
  CHECK(run->number == 1);  // the number in that folder's name is another daemon's
  CHECK(run->state == RunState::ended);
  CHECK(store.run(1).value()->folder == elsewhere / "R-000009");
  fs::create_directories(folder / "R-000009");  // folder of a run of this daemon
  CHECK(store.run(1).value()->folder == elsewhere / "R-000009");
  const auto line = store.tail(run->id(), 1).value().front();
  CHECK(line.kind == "imported");
  CHECK(line.by == "ada");
  const auto again = add_found_run(store, paths, *found, "ada", now_us);
  REQUIRE_FALSE(again);
  CHECK(again.error().code == Errc::wrong_state);
  CHECK(again.error().got == "R-000001");
  CHECK(store.runs()->size() == 1);
}

TEST_CASE("what is no campaign, is damaged or is being recorded is not added") {
  const TemporaryFolder folder;
  const CataloguePaths paths = paths_in(folder);
  CHECK(load_found_run(folder / "none", paths).error().code == Errc::not_found);
  campaign_in(folder, folder / "mine");
  {
    const auto lock = FolderLock::take(folder / "mine");
    REQUIRE(lock);
    CHECK(load_found_run(folder / "mine", paths).error().code == Errc::busy);
    const auto report = rebuild_catalogue(paths, now_us);
    REQUIRE(report);
    CHECK(report->added.empty());
    REQUIRE(report->left_out.size() == 1);
    CHECK(report->left_out.front().code == Errc::busy);
  }
  fs::resize_file(folder / "mine/campaign.sqlite", 1000);
  CHECK(is_damage(load_found_run(folder / "mine", paths).error().code));
}

TEST_CASE("a daemon that works in the folder keeps its catalogue") {
  const TemporaryFolder folder;
  RunStore store = open_store(folder);
  const auto refused = rebuild_catalogue(paths_in(folder), now_us);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::busy);
}

}  // namespace catalogue_test
