// The daemon's store of its runs: its file, older files, and joint writes.

#include "tests/unit/daemon/service/run_manager_bench.hpp"

namespace run_store_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::runs;
using test::TemporaryFolder;

namespace {

void check_same(const StoredRun& found, const StoredRun& wanted) {
  const RunFacts &facts = found, &wanted_facts = wanted;
  CHECK(facts.outcome == wanted_facts.outcome);
  CHECK(facts.cleanup == wanted_facts.cleanup);
  CHECK(facts.rig_fact == wanted_facts.rig_fact);
  CHECK(facts.error == wanted_facts.error);
  CHECK(facts.dataset_sha256 == wanted_facts.dataset_sha256);
  CHECK(facts.dataset_error == wanted_facts.dataset_error);
  CHECK(facts.bench_outcome == wanted_facts.bench_outcome);
  CHECK(facts.bench_error == wanted_facts.bench_error);
  CHECK(found.number == wanted.number);
  CHECK(found.recipe.string() == wanted.recipe.string());
  CHECK(found.rig.string() == wanted.rig.string());
  CHECK(found.folder.string() == wanted.folder.string());
  CHECK(found.recipe_sha256 == wanted.recipe_sha256);
  CHECK(found.seed == wanted.seed);
  CHECK(found.name == wanted.name);
  CHECK(found.by == wanted.by);
  CHECK(found.created_us == wanted.created_us);
  CHECK(found.state == wanted.state);
  CHECK(found.bench == wanted.bench);
  CHECK(found.trials_done == wanted.trials_done);
  CHECK(found.trials_planned == wanted.trials_planned);
  CHECK(found.disk_bytes == wanted.disk_bytes);
  CHECK(found.resume == wanted.resume);
  CHECK(found.recovered == wanted.recovered);
  CHECK(found.rig_untaken == wanted.rig_untaken);
}

}  // namespace

TEST_CASE("each field of a run is read back as it was written, and as it was written again") {
  const TemporaryFolder folder;
  RunStore store = std::move(RunStore::open(folder / "weftd.sqlite").value());
  StoredRun run;
  run.recipe = "denim.json";
  run.rig = "bench.json";
  run.folder = folder / "R-000001";
  run.recipe_sha256 = "36426411";
  run.seed = 18446744073709551615U;
  run.name = "first";
  run.by = "ada";
  run.created_us = 20;
  run.state = RunState::held;
  run.bench = "simulated";
  run.trials_done = 30;
  run.trials_planned = 40;
  run.disk_bytes = 50;
  run.resume = true;
  run.recovered = "discard";
  run.rig_untaken = false;
  run.facts() = {.outcome = "stopped",
                 .cleanup = "done",
                 .rig_fact = "safe",
                 .error = "stalled",
                 .dataset_sha256 = "5d41402a",
                 .dataset_error = "no room",
                 .bench_outcome = "aborted",
                 .bench_error = "no device answers"};
  REQUIRE(test::add(store, run));
  REQUIRE(store.runs()->size() == 1);
  check_same(store.runs()->front(), run);

  run.folder = folder / "R-000001-2";
  run.state = RunState::interrupted;
  run.bench = "real";
  run.trials_done.reset();
  run.trials_planned = 41;
  run.disk_bytes = 51;
  run.resume = false;
  run.recovered = "keep-partial";
  run.rig_untaken = true;
  run.facts() = {.outcome = "interrupted",
                 .cleanup = "skipped",
                 .rig_fact = "unknown",
                 .error = "cut",
                 .dataset_sha256 = "7d793037",
                 .dataset_error = "no disk",
                 .bench_outcome = "failed",
                 .bench_error = "timeout"};
  REQUIRE(store.commit({.runs = {run}}));
  REQUIRE(store.runs()->size() == 1);
  check_same(store.runs()->front(), run);
}

TEST_CASE("a run with a seed that is no number is corrupt, as with any other field") {
  const test::TemporaryFolder folder;
  const auto file = folder / "weftd.sqlite";
  {
    auto store = runs::RunStore::open(file);
    REQUIRE(store);
    runs::StoredRun run;
    REQUIRE(test::add(*store, run));
  }
  for (const std::string_view seed : {"many", "12 ", "99999999999999999999"}) {
    {
      auto database = sqlite::Database::open(file, sqlite::Mode::read_write);
      REQUIRE(database);
      auto change = database->prepare("UPDATE run SET seed = ?");
      REQUIRE(change);
      REQUIRE(change->bind(1, seed).run());
    }
    const auto read = runs::RunStore::open(file);
    REQUIRE_FALSE(read);
    CHECK(read.error().code == Errc::corrupt);
    CHECK(read.error().got == seed);
  }
}

TEST_CASE("a database in use is refused with the name of its file") {
  const test::TemporaryFolder folder;
  const auto file = folder / "weftd.sqlite";
  auto first = runs::RunStore::open(file);
  REQUIRE(first);
  const auto second = runs::RunStore::open(file);
  REQUIRE_FALSE(second);
  CHECK(second.error().code == Errc::busy);
  CHECK(second.error().where == file.string());
  CHECK(second.error().got.empty());  // not the refusal of the database
  auto other = sqlite::Database::open(file, sqlite::Mode::read_write);
  REQUIRE(other);
  const Status refused = other->execute("CREATE TABLE more (one INTEGER)");
  REQUIRE_FALSE(refused);
  CHECK(refused.error().code == Errc::busy);
  CHECK(refused.error().where == file.string());
}

TEST_CASE("a memory of runs from before there was the wish to resume is read, without one") {
  const TemporaryFolder folder;
  {
    RunStore store = std::move(RunStore::open(folder / "weftd.sqlite").value());
    StoredRun run;
    REQUIRE(test::add(store, run));
    run.resume = true;
    REQUIRE(store.commit({.runs = {run}}));
    CHECK(store.runs().value().front().resume);
  }
  {
    auto file = sqlite::Database::open(folder / "weftd.sqlite", sqlite::Mode::read_write);
    REQUIRE(file->execute("ALTER TABLE run DROP COLUMN resume"));
  }
  RunStore store = std::move(RunStore::open(folder / "weftd.sqlite").value());
  CHECK_FALSE(store.runs().value().front().resume);
}

TEST_CASE("fact, latch and lock-out of the rig are kept apart") {
  const TemporaryFolder folder;
  const RigState rigs[] = {RigState{}, RigState{RigFact::unknown, "R-000001"},
                           RigState{Latch{true, "ada: smoke"}},
                           RigState{RigFacts{RigFact::holding, "R-000002", true}},
                           RigState{RigFacts{RigFact::holding, "R-000002", false,
                                             Latch{false, "bo"}, LockOut{"ada", "cable", 5}}}};
  for (const RigState& rig : rigs) {
    REQUIRE(RunStore::open(folder / "weftd.sqlite")->commit({.rig = rig}));
    CHECK(RunStore::open(folder / "weftd.sqlite")->rig_state().value() == rig);
  }
}

TEST_CASE("a latch of an older file does not determine how the rig was left") {
  const TemporaryFolder folder;
  RunStore store = std::move(RunStore::open(folder / "weftd.sqlite").value());
  struct Row {
    const char *fact, *why;
    RigState rig;
  };
  const Row rows[] = {
      {"safe", "", RigState{}},
      {"unknown", "R-000001", RigState{RigFact::unknown, "R-000001"}},
      {"latched", "ada", RigState{RigFacts{RigFact::unknown, "", false, Latch{false, "ada"}}}},
      {"estop", "bo", RigState{RigFacts{RigFact::unknown, "", false, Latch{true, "bo"}}}}};
  for (const auto& [fact, why, rig] : rows) {
    REQUIRE(store.database().run("INSERT OR REPLACE INTO rig (id, fact, why) VALUES (1, ?, ?)",
                                 std::string(fact), std::string(why)));
    CHECK(store.rig_state().value() == rig);
  }
  REQUIRE(store.database().execute("UPDATE rig SET fact = 'asleep'"));
  CHECK(store.rig_state().error().code == Errc::corrupt);
}

TEST_CASE("of a run from before it was kept who has the rig, that is unknown") {
  const TemporaryFolder folder;
  const bool is_old = GENERATE(true, false);
  StoredRun run;
  run.state = RunState::arming;
  run.rig_untaken = true;
  {
    RunStore store = std::move(RunStore::open(folder / "weftd.sqlite").value());
    REQUIRE(test::add(store, run));
    REQUIRE(store.commit({.runs = {run}}));
  }
  if (is_old) {
    auto file = sqlite::Database::open(folder / "weftd.sqlite", sqlite::Mode::read_write);
    REQUIRE(file->execute("ALTER TABLE run DROP COLUMN rig_untaken"));
  }
  RunStore store = std::move(RunStore::open(folder / "weftd.sqlite").value());
  const RigState unknown{RigFact::unknown, run.id()};
  CHECK(store.rig_state().value() == (is_old ? unknown : RigState{}));
  const StoredRun found = store.runs().value().front();
  CHECK(found.state == RunState::interrupted);
  CHECK(found.rig_fact == (is_old ? "unknown" : "safe"));
  CHECK_FALSE(found.rig_untaken);
}

TEST_CASE("what is known of a data set is kept while its run's folder is not to be seen") {
  const TemporaryFolder folder;
  StoredRun run;
  run.state = RunState::arming;
  run.rig_untaken = run.resume = true;
  run.folder = folder / "R-000001";
  run.outcome = "stopped";
  run.dataset_sha256 = "36426411";
  run.dataset_error = "no room";
  {
    RunStore store = std::move(RunStore::open(folder / "weftd.sqlite").value());
    REQUIRE(test::add(store, run));
    REQUIRE(store.commit({.runs = {run}}));
  }
  const StoredRun found = RunStore::open(folder / "weftd.sqlite")->runs()->front();
  CHECK(found.state == RunState::interrupted);
  CHECK(found.dataset_sha256 == "36426411");
  CHECK(found.dataset_error == "no room");
}

TEST_CASE("what belongs together is written together or not at all") {
  const TemporaryFolder folder;
  RunStore store = std::move(RunStore::open(folder / "weftd.sqlite").value());
  StoredRun run;
  run.number = store.next_number().value();
  RunChange change{.runs = {run}, .journal = {{0, 0, "R-000001", "submitted", "test"}}};
  REQUIRE(store.database().execute(
      "CREATE TRIGGER full BEFORE INSERT ON journal BEGIN SELECT RAISE(ABORT, 'no room'); END"));
  const Status refused = store.commit(change);
  REQUIRE_FALSE(refused);
  CHECK(to_string(refused.error()).find("no room") != std::string::npos);
  CHECK(store.runs()->empty());
  REQUIRE(store.database().execute("DROP TRIGGER full"));
  REQUIRE(store.commit(change));
  CHECK(store.runs()->size() == 1);
}

}  // namespace run_store_test
