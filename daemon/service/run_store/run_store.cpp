#include "daemon/service/run_store/run_store.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "daemon/campaign/resume.hpp"
#include "daemon/service/run_store/run_rows.hpp"
#include "daemon/service/run_store/run_schema.hpp"

namespace weft::daemon::runs {
namespace {

// Full synchronisation: what was answered is on the disk, also when the power goes.
constexpr const char* opening_sql =
    "PRAGMA locking_mode=EXCLUSIVE; PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;"
    "BEGIN IMMEDIATE; COMMIT;";

/// The fact of a rig that an emergency stop has latched.
constexpr std::string_view emergency_name = "estop";

std::filesystem::path make_absolute(const std::filesystem::path& folder) {
  std::error_code none;
  auto absolute = std::filesystem::absolute(folder.empty() ? "." : folder, none);
  return none ? folder : absolute.lexically_normal();
}

/// SQLite's look at every page now: damage that is found only later would fail a run.
Status check_pages(sqlite::Database& database) {
  auto query = database.prepare("PRAGMA quick_check(1)");
  if (!query) return pass(query.error());
  const auto row = query->step();
  if (!row) return pass(row.error());
  if (*row && query->text(0) == "ok") return {};
  return fail(
      {.code = Errc::corrupt,
       .what = "the daemon's memory of its runs is damaged",
       .got = query->text(0),
       .hint =
           "Put back a copy of it, or move it away: the campaigns are whole in their own files"});
}

/// An existing folder: SQLite reports one that cannot be written to as an error of its lock.
Status check_folder(const std::filesystem::path& folder) {
  if (folder.empty() || ::access(folder.c_str(), W_OK) == 0) return {};
  const std::error_code why(errno, std::generic_category());
  return fail({.code = Errc::io,
               .where = folder.string(),
               .what = "the folder cannot be written to",
               .got = why.message(),
               .hint = "Give the daemon a folder of its own that it may write to"});
}

bool was_under_way(const StoredRun& run) {
  return run.state != RunState::queued && run.state != RunState::ended &&
         run.state != RunState::interrupted;
}

/// Nothing was moved or recorded; what only concludes may have come to its end.
void cut_before_rig(StoredRun& run, const RigState& rig) {
  if (run.outcome.empty()) {
    run.outcome = "interrupted";
    run.cleanup = "skipped";
    run.trials_done = 0;
  }
  run.rig_fact = to_string(rig.fact());
  std::error_code unseen;
  if (!std::filesystem::exists(run.folder / campaign_file_name, unseen))
    return;  // it may come back
  const std::string certified = certified_dataset(run.folder);
  if (certified != run.dataset_sha256) run.dataset_error.clear();
  run.dataset_sha256 = certified;
}

void cut_on_rig(StoredRun& run) {
  if (run.state == RunState::arming && !run.resume)
    run.trials_done = 0;
  else
    run.trials_done.reset();  // more may have been recorded since
  run.outcome = "interrupted";
  run.cleanup = "skipped";
  run.rig_fact = "unknown";
  for (std::string* fact : {&run.error, &run.bench_outcome, &run.bench_error}) fact->clear();
  run.dataset_error.clear();
  run.dataset_sha256 = certified_dataset(run.folder);
}

}  // namespace

bool StoredRun::has_all() const {
  if (!dataset_error.empty() || recovered == "discard") return false;
  const bool counted = trials_done && trials_done == trials_planned;
  return outcome == "complete" || (counted && !dataset_sha256.empty());
}

bool RunChange::is_empty() const {
  return runs.empty() && !queue && !rig && journal.empty() && !recipe;
}

void RunChange::put(const StoredRun& run) {
  const auto known = std::ranges::find(runs, run.number, &StoredRun::number);
  if (known == runs.end())
    runs.push_back(run);
  else
    *known = run;
}

void RunChange::add(const RunChange& later) {
  for (const StoredRun& run : later.runs) put(run);
  if (later.queue) queue = later.queue;
  if (later.rig) rig = later.rig;
  if (later.recipe) recipe = later.recipe;
  journal.insert(journal.end(), later.journal.begin(), later.journal.end());
}

Result<RunStore> RunStore::open(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.parent_path();
  if (Status usable = check_folder(folder); !usable) return pass(usable.error());
  auto database = sqlite::Database::open(file, sqlite::Mode::create);
  if (!database) return pass(database.error(), file.string());
  if (const Status alone = database->execute(opening_sql); !alone) {
    if (alone.error().code != Errc::busy) return pass(alone.error(), file.string());
    return fail({.code = Errc::busy,
                 .where = file.string(),
                 .what = "another weftd works in this folder",
                 .hint = "Stop it, or give this one a folder of its own"});
  }
  Status ok = check_pages(*database);
  if (ok) ok = make_tables(*database);
  if (!ok) return pass(ok.error(), file.string());
  RunStore store(std::move(*database),
                 file == ":memory:" ? std::filesystem::path() : make_absolute(folder));
  ok = store.recover_after_restart();
  if (!ok) return pass(ok.error(), file.string());
  return store;
}

Status RunStore::recover_after_restart() {
  const auto known = runs();
  if (!known) return pass(known.error());
  const auto before = rig_state();
  if (!before) return pass(before.error());
  RunChange change;
  for (StoredRun run : *known) {
    if (!was_under_way(run)) continue;
    const bool acquired_rig = !std::exchange(run.rig_untaken, false);
    if (acquired_rig)
      cut_on_rig(run);
    else
      cut_before_rig(run, *before);
    run.state = RunState::interrupted;
    if (acquired_rig && !before->is_latched())
      change.rig = RigState(RigState::Fact::unknown, run.id());
    change.put(run);
  }
  return change.is_empty() ? Status() : commit(change);
}

Status RunStore::in_place() const {
  if (!database_.has_moved()) return {};
  return fail(
      {.code = Errc::io,
       .where = (home_ / store_file_name).string(),
       .what = "the daemon's memory is not in its folder any more",
       .expected = "as it was opened",
       .got = "moved or removed",
       .hint = "Put it back, or start weftd anew: what it did from here on would be forgotten"});
}

Status RunStore::commit(const RunChange& change) {
  const Status done = transact({&unwritten_, &change});
  if (done) unwritten_ = {};
  return done;
}

// A full disk may have room for the rig's one row and not for the journal: a daemon that died then
// would have forgotten a latch.
void RunStore::persist(const RunChange& change) {
  if ((change.is_empty() && is_persisted()) || commit(change)) return;
  unwritten_.add(change);
  RunChange facts = unwritten_;
  facts.journal.clear();
  const RunChange rig{.rig = unwritten_.rig};
  if (!facts.is_empty() && transact({&facts}))
    unwritten_ = {.journal = std::move(unwritten_.journal)};
  else if (rig.rig && transact({&rig}))
    unwritten_.rig.reset();
}

Status RunStore::transact(std::initializer_list<const RunChange*> changes) {
  Status done = in_place();
  if (done) done = database_.execute("BEGIN IMMEDIATE");
  if (!done) return done;
  for (const RunChange* const change : changes)
    if (done) done = write(*change);
  if (done) done = database_.execute("COMMIT");
  // Where SQLite has rolled back by itself, as on a full disk, there is no more to do.
  if (!done) static_cast<void>(database_.execute("ROLLBACK"));
  return done;
}

Status RunStore::append_journal(std::int64_t utc_us, std::string_view run, std::string_view kind,
                                std::string_view by, std::string_view payload_json) {
  return commit({.journal = {{0, utc_us, std::string(run), std::string(kind), std::string(by),
                              std::string(payload_json)}}});
}

Status RunStore::write(const RunChange& change) {
  Status done;
  if (change.recipe) {
    auto insert = database_.prepare("INSERT OR IGNORE INTO recipe (sha256, text) VALUES (?, ?)");
    if (!insert) return pass(insert.error());
    insert->bind(1, change.recipe->sha256).bind(2, change.recipe->text);
    done = insert->run();
  }
  if (done && change.rig) done = write(*change.rig);
  for (auto run = change.runs.begin(); done && run != change.runs.end(); ++run)
    done = write_run(database_, home_, *run);
  if (done && change.queue) done = write(*change.queue);
  for (auto line = change.journal.begin(); done && line != change.journal.end(); ++line)
    done = write(*line);
  return done;
}

Status RunStore::write(const RigState& rig) {
  auto change = database_.prepare("INSERT OR REPLACE INTO rig (id, fact, why) VALUES (1, ?, ?)");
  if (!change) return pass(change.error());
  change->bind(1, rig.is_emergency() ? emergency_name : to_string(rig.fact())).bind(2, rig.why());
  return change->run();
}

Result<RigState> RunStore::rig_state() {
  using enum RigState::Fact;
  auto query = database_.prepare("SELECT fact, why FROM rig");
  if (!query) return pass(query.error());
  const auto row = query->step();
  if (!row) return pass(row.error());
  if (!*row) return RigState();
  const std::string name = query->text(0);
  if (name == emergency_name) return RigState(latched, query->text(1), true);
  for (const RigState::Fact fact : {safe, unknown, latched})
    if (to_string(fact) == name) return RigState(fact, query->text(1));
  return fail({.code = Errc::corrupt,
               .where = "rig",
               .what = "a rig in no state that there is",
               .got = name});
}

Status RunStore::write(const RunQueue& queue) {
  auto head =
      database_.prepare("INSERT OR REPLACE INTO line (id, revision, held_by) VALUES (1, ?, ?)");
  if (!head) return pass(head.error());
  head->bind(1, queue.revision()).bind(2, queue.paused_by());
  Status done = head->run();
  if (done) done = database_.execute("DELETE FROM waiting");
  if (!done) return done;
  auto insert = database_.prepare("INSERT INTO waiting (place, run) VALUES (?, ?)");
  if (!insert) return pass(insert.error());
  for (std::size_t place = 0; done && place < queue.runs().size(); ++place) {
    insert->bind(1, static_cast<std::int64_t>(place)).bind(2, queue.runs()[place]);
    done = insert->run();
  }
  return done;
}

Result<RunQueue> RunStore::queue() {
  auto query = database_.prepare("SELECT revision, held_by FROM line");
  if (!query) return pass(query.error());
  auto row = query->step();
  if (!row) return pass(row.error());
  if (!*row) return RunQueue();
  auto waiting = database_.prepare("SELECT run FROM waiting ORDER BY place");
  if (!waiting) return pass(waiting.error());
  std::vector<std::int64_t> runs;
  for (row = waiting->step(); row && *row; row = waiting->step())
    runs.push_back(waiting->integer(0));
  if (!row) return pass(row.error());
  return RunQueue(query->integer(0), query->text(1), std::move(runs));
}

Result<std::vector<StoredRun>> RunStore::runs() {
  return read_runs(database_, home_);
}

Result<std::int64_t> RunStore::next_number() {
  auto query =
      database_.prepare("SELECT coalesce(max(seq), 0) + 1 FROM sqlite_sequence WHERE name = 'run'");
  if (!query) return pass(query.error());
  if (const auto row = query->step(); !row) return pass(row.error());
  return query->integer(0);
}

Result<std::string> RunStore::recipe_text(std::string_view sha256) {
  auto query = database_.prepare("SELECT text FROM recipe WHERE sha256 = ?");
  if (!query) return pass(query.error());
  query->bind(1, sha256);
  const auto row = query->step();
  if (!row) return pass(row.error());
  if (!*row)
    return fail({.code = Errc::corrupt,
                 .where = "recipe",
                 .what = "a run whose recipe is not there",
                 .expected = std::string(sha256)});
  return std::string(query->text(0));
}

}  // namespace weft::daemon::runs
