#include "daemon/service/runs/run_store.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <system_error>

namespace weft::daemon::control {
namespace {

constexpr const char* schema_sql = R"sql(
CREATE TABLE IF NOT EXISTS run (
  number INTEGER PRIMARY KEY AUTOINCREMENT,
  recipe TEXT NOT NULL, rig TEXT NOT NULL, folder TEXT NOT NULL, seed TEXT NOT NULL,
  name TEXT NOT NULL, by TEXT NOT NULL, created_us INTEGER NOT NULL,
  state TEXT NOT NULL, outcome TEXT NOT NULL, cleanup TEXT NOT NULL, rig_fact TEXT NOT NULL,
  error TEXT NOT NULL, dataset_sha256 TEXT NOT NULL, resume INTEGER NOT NULL DEFAULT 0,
  recovered TEXT NOT NULL DEFAULT '', bench TEXT NOT NULL DEFAULT '',
  trials_done INTEGER, trials_planned INTEGER, recipe_sha256 TEXT NOT NULL DEFAULT '',
  dataset_error TEXT NOT NULL DEFAULT '', rig_untaken INTEGER NOT NULL DEFAULT 0,
  bench_outcome TEXT NOT NULL DEFAULT '', bench_error TEXT NOT NULL DEFAULT '',
  disk_bytes INTEGER NOT NULL DEFAULT 0
) STRICT;
CREATE TABLE IF NOT EXISTS recipe (sha256 TEXT PRIMARY KEY, text TEXT NOT NULL) STRICT;
CREATE TABLE IF NOT EXISTS journal (
  sequence INTEGER PRIMARY KEY AUTOINCREMENT, utc_us INTEGER NOT NULL,
  run TEXT NOT NULL, kind TEXT NOT NULL, by TEXT NOT NULL, payload_json TEXT NOT NULL
) STRICT;
CREATE TABLE IF NOT EXISTS line (
  id INTEGER PRIMARY KEY CHECK (id = 1), revision INTEGER NOT NULL, held_by TEXT NOT NULL
) STRICT;
CREATE TABLE IF NOT EXISTS waiting (place INTEGER PRIMARY KEY, run INTEGER NOT NULL) STRICT;
CREATE TABLE IF NOT EXISTS rig (
  id INTEGER PRIMARY KEY CHECK (id = 1), fact TEXT NOT NULL, why TEXT NOT NULL
) STRICT;
CREATE TABLE IF NOT EXISTS answer (
  number INTEGER PRIMARY KEY AUTOINCREMENT, name TEXT NOT NULL UNIQUE, fingerprint TEXT NOT NULL,
  asked_us INTEGER NOT NULL, result TEXT, error TEXT, token TEXT NOT NULL DEFAULT ''
) STRICT;
CREATE TABLE IF NOT EXISTS hand_over (
  run INTEGER PRIMARY KEY, state TEXT NOT NULL, by TEXT NOT NULL, error TEXT NOT NULL,
  result_json TEXT NOT NULL, attempts INTEGER NOT NULL DEFAULT 0
) STRICT;
)sql";

// Full synchronisation: what was answered is on the disk, also when the power goes.
constexpr const char* opening_sql =
    "PRAGMA locking_mode=EXCLUSIVE; PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;"
    "BEGIN IMMEDIATE; COMMIT;";

Result<RunState> state_from(const std::string& name) {
  const auto* found = std::find_if(all_run_states.begin(), all_run_states.end(),
                                   [&](RunState s) { return to_string(s) == name; });
  if (found == all_run_states.end())
    return fail({.code = Errc::corrupt,
                 .where = "run",
                 .what = "a run in no state that there is",
                 .got = name});
  return *found;
}

constexpr std::array facts{RigStanding::Fact::safe, RigStanding::Fact::unknown,
                           RigStanding::Fact::latched};

/// The fact of a rig that an emergency stop has latched.
constexpr std::string_view emergency_name = "estop";

/// Nothing where the recipe's is taken.
Result<std::optional<std::uint64_t>> seed_from(const std::string& text) {
  if (text.empty()) return std::optional<std::uint64_t>();
  std::uint64_t seed = 0;
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, seed);
  if (read.ec == std::errc() && read.ptr == end) return std::optional(seed);
  return fail({.code = Errc::corrupt,
               .where = "run",
               .what = "a run with a seed that is none",
               .expected = "0 to 2^64 - 1",
               .got = text});
}

Result<StoredRun> read_run(const sqlite::Statement& row) {
  StoredRun run;
  run.number = row.integer(0);
  run.recipe = row.text(1);
  run.rig = row.text(2);
  run.folder = row.text(3);
  const auto seed = seed_from(row.text(4));
  if (!seed) return pass(seed.error());
  run.seed = *seed;
  run.name = row.text(5);
  run.by = row.text(6);
  run.created_us = row.integer(7);
  const auto state = state_from(row.text(8));
  if (!state) return pass(state.error());
  run.state = *state;
  run.outcome = row.text(9);
  run.cleanup = row.text(10);
  run.rig_fact = row.text(11);
  run.error = row.text(12);
  run.dataset_sha256 = row.text(13);
  run.resume = row.integer(14) != 0;
  run.recovered = row.text(15);
  run.bench = row.text(16);
  if (!row.is_null(17)) run.trials_done = row.integer(17);
  if (!row.is_null(18)) run.trials_planned = row.integer(18);
  run.recipe_sha256 = row.text(19);
  run.dataset_error = row.text(20);
  run.rig_untaken = row.integer(21) != 0;
  run.bench_outcome = row.text(22);
  run.bench_error = row.text(23);
  run.disk_bytes = static_cast<std::uint64_t>(row.integer(24));
  return run;
}

/// A column that younger files have from the beginning.
struct LaterColumn {
  std::string_view table, name;
  const char* alter_sql;
};
constexpr std::array later_columns{
    LaterColumn{"run", "resume", "ALTER TABLE run ADD COLUMN resume INTEGER NOT NULL DEFAULT 0"},
    LaterColumn{"run", "recovered",
                "ALTER TABLE run ADD COLUMN recovered TEXT NOT NULL DEFAULT ''"},
    LaterColumn{"run", "bench", "ALTER TABLE run ADD COLUMN bench TEXT NOT NULL DEFAULT ''"},
    LaterColumn{"run", "trials_done", "ALTER TABLE run ADD COLUMN trials_done INTEGER"},
    LaterColumn{"run", "trials_planned", "ALTER TABLE run ADD COLUMN trials_planned INTEGER"},
    LaterColumn{"run", "recipe_sha256",
                "ALTER TABLE run ADD COLUMN recipe_sha256 TEXT NOT NULL DEFAULT ''"},
    LaterColumn{"run", "dataset_error",
                "ALTER TABLE run ADD COLUMN dataset_error TEXT NOT NULL DEFAULT ''"},
    LaterColumn{"run", "rig_untaken",
                "ALTER TABLE run ADD COLUMN rig_untaken INTEGER NOT NULL DEFAULT 0"},
    LaterColumn{"run", "bench_outcome",
                "ALTER TABLE run ADD COLUMN bench_outcome TEXT NOT NULL DEFAULT ''"},
    LaterColumn{"run", "bench_error",
                "ALTER TABLE run ADD COLUMN bench_error TEXT NOT NULL DEFAULT ''"},
    LaterColumn{"run", "disk_bytes",
                "ALTER TABLE run ADD COLUMN disk_bytes INTEGER NOT NULL DEFAULT 0"},
    LaterColumn{"answer", "token", "ALTER TABLE answer ADD COLUMN token TEXT NOT NULL DEFAULT ''"},
    LaterColumn{"hand_over", "attempts",
                "ALTER TABLE hand_over ADD COLUMN attempts INTEGER NOT NULL DEFAULT 0"}};

/// A file from before there was the column gets it.
Status add_columns(sqlite::Database& database) {
  for (const LaterColumn& column : later_columns) {
    auto query = database.prepare("SELECT count(*) FROM pragma_table_info(?) WHERE name = ?");
    if (!query) return pass(query.error());
    query->bind(1, column.table).bind(2, column.name);
    const auto row = query->step();
    if (!row) return pass(row.error());
    if (query->integer(0) > 0) continue;
    if (Status done = database.execute(column.alter_sql); !done) return done;
  }
  return {};
}

std::filesystem::path absolute_of(const std::filesystem::path& folder) {
  std::error_code none;
  auto absolute = std::filesystem::absolute(folder.empty() ? "." : folder, none);
  return none ? folder : absolute.lexically_normal();
}

/// SQLite's look at every page now: one that is needed only later would be missed under a run.
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

}  // namespace

std::string_view to_string(RigStanding::Fact fact) {
  constexpr std::array<std::string_view, 3> names{"safe", "unknown", "latched"};
  return names[static_cast<std::size_t>(fact)];
}

std::string StoredRun::id() const {
  std::string digits = std::to_string(number);
  constexpr std::size_t width = 6;
  if (digits.size() < width) digits.insert(0, width - digits.size(), '0');
  return "R-" + digits;
}

bool StoredRun::has_all() const {
  if (!dataset_error.empty() || recovered == "discard") return false;
  const bool counted = trials_done && trials_done == trials_planned;
  return outcome == "complete" || (counted && !dataset_sha256.empty());
}

Result<RunStore> RunStore::open(const std::filesystem::path& file) {
  // SQLite's own word for it is an error of its lock.
  const std::filesystem::path folder = file.parent_path();
  if (!folder.empty() && ::access(folder.c_str(), W_OK) != 0) {
    const std::error_code why(errno, std::generic_category());
    return fail({.code = Errc::io,
                 .where = folder.string(),
                 .what = "the folder cannot be written to",
                 .got = why.message(),
                 .hint = "Give the daemon a folder of its own that it may write to"});
  }
  auto database = sqlite::Database::open(file, sqlite::Mode::create);
  if (!database) return pass(database.error(), file.string());
  if (const Status alone = database->execute(opening_sql); !alone) {
    if (alone.error().code != Errc::busy) return pass(alone.error(), file.string());
    return fail({.code = Errc::busy,
                 .where = file.string(),
                 .what = "another weftd works in this folder",
                 .hint = "Stop it, or give this one a folder of its own"});
  }
  if (const Status whole = check_pages(*database); !whole)
    return pass(whole.error(), file.string());
  Status made = database->execute(schema_sql);
  if (made) made = add_columns(*database);
  if (!made) return pass(made.error(), file.string());
  RunStore store(std::move(*database),
                 file == ":memory:" ? std::filesystem::path() : absolute_of(folder));
  if (Status ok = store.take_stock(); !ok) return pass(ok.error(), file.string());
  return store;
}

Result<RigStanding> RunStore::standing() {
  auto query = database_.prepare("SELECT fact, why FROM rig");
  if (!query) return pass(query.error());
  const auto row = query->step();
  if (!row) return pass(row.error());
  if (!*row) return RigStanding{};
  const std::string name = query->text(0);
  if (name == emergency_name) return RigStanding{RigStanding::Fact::latched, query->text(1), true};
  const auto* found =
      std::find_if(facts.begin(), facts.end(), [&](auto fact) { return to_string(fact) == name; });
  if (found == facts.end())
    return fail({.code = Errc::corrupt,
                 .where = "rig",
                 .what = "a rig in no state that there is",
                 .got = name});
  return RigStanding{*found, query->text(1)};
}

Status RunStore::keep(const RigStanding& standing) {
  auto change = writing("INSERT OR REPLACE INTO rig (id, fact, why) VALUES (1, ?, ?)");
  if (!change) return pass(change.error());
  change->bind(1, standing.emergency ? emergency_name : to_string(standing.fact))
      .bind(2, standing.why);
  return change->run();
}

Result<RunLine> RunStore::line() {
  RunLine out;
  auto query = database_.prepare("SELECT revision, held_by FROM line");
  if (!query) return pass(query.error());
  auto row = query->step();
  if (!row) return pass(row.error());
  if (!*row) return out;
  out.revision = query->integer(0);
  out.held_by = query->text(1);
  auto waiting = database_.prepare("SELECT run FROM waiting ORDER BY place");
  if (!waiting) return pass(waiting.error());
  for (row = waiting->step(); row && *row; row = waiting->step())
    out.runs.push_back(waiting->integer(0));
  if (!row) return pass(row.error());
  return out;
}

Status RunStore::keep(const RunLine& line) {
  return database_.in_transaction() ? write(line) : together([&] { return write(line); });
}

Status RunStore::write(const RunLine& line) {
  auto head = writing("INSERT OR REPLACE INTO line (id, revision, held_by) VALUES (1, ?, ?)");
  if (!head) return pass(head.error());
  head->bind(1, line.revision).bind(2, line.held_by);
  Status done = head->run();
  if (done) done = database_.execute("DELETE FROM waiting");
  if (!done) return done;
  auto insert = writing("INSERT INTO waiting (place, run) VALUES (?, ?)");
  if (!insert) return pass(insert.error());
  for (std::size_t place = 0; done && place < line.runs.size(); ++place) {
    insert->bind(1, static_cast<std::int64_t>(place)).bind(2, line.runs[place]);
    done = insert->run();
  }
  return done;
}

Result<std::vector<StoredRun>> RunStore::load() {
  auto query = database_.prepare(
      "SELECT number, recipe, rig, folder, seed, name, by, created_us, state, outcome, cleanup, "
      "rig_fact, error, dataset_sha256, resume, recovered, bench, trials_done, trials_planned, "
      "recipe_sha256, dataset_error, rig_untaken, bench_outcome, bench_error, disk_bytes FROM run "
      "ORDER BY number");
  if (!query) return pass(query.error());
  std::vector<StoredRun> out;
  for (;;) {
    const auto row = query->step();
    if (!row) return pass(row.error());
    if (!*row) return out;
    auto run = read_run(*query);
    if (!run) return pass(run.error());
    run->folder = found_folder(run->folder.string());
    out.push_back(std::move(*run));
  }
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

Result<sqlite::Statement> RunStore::writing(std::string_view sql) {
  if (Status here = in_place(); !here) return pass(here.error());
  return database_.prepare(sql);
}

Status RunStore::together(const std::function<Status()>& work) {
  Status done = in_place();
  if (done) done = database_.execute("BEGIN IMMEDIATE");
  if (!done) return done;
  done = work();
  if (done) done = database_.execute("COMMIT");
  // Where SQLite has rolled back by itself, as it does when the disk is full, there is no more to
  // do.
  if (!done) static_cast<void>(database_.execute("ROLLBACK"));
  return done;
}

std::string RunStore::kept_folder(const std::filesystem::path& folder) const {
  if (home_.empty() || folder.empty()) return folder.string();
  const std::filesystem::path way = absolute_of(folder).lexically_relative(home_);
  const bool within = !way.empty() && *way.begin() != ".." && way != ".";
  return within ? way.string() : folder.string();
}

// Older daemons kept what they were given: the way from where they were started, or one that holds
// until the folder is moved. Then its name is looked for here.
std::filesystem::path RunStore::found_folder(const std::string& kept) const {
  const std::filesystem::path folder = kept;
  if (home_.empty() || folder.empty()) return folder;
  const std::filesystem::path here = home_ / folder.filename();
  std::error_code unseen;
  for (const auto& place : {folder.is_relative() ? home_ / folder : here, here})
    if (std::filesystem::exists(place, unseen)) return place;
  return home_ / folder;
}

Status RunStore::add(StoredRun& run) {
  auto insert = writing(
      "INSERT INTO run (recipe, rig, folder, seed, name, by, created_us, state, outcome, cleanup, "
      "rig_fact, error, dataset_sha256, recipe_sha256) VALUES (?,?,?,?,?,?,?,?,'','','','','',?)");
  if (!insert) return pass(insert.error());
  const std::string recipe = run.recipe.string(), rig = run.rig.string(),
                    folder = kept_folder(run.folder),
                    seed = run.seed ? std::to_string(*run.seed) : std::string();
  insert->bind(1, recipe).bind(2, rig).bind(3, folder).bind(4, seed);
  insert->bind(5, run.name).bind(6, run.by).bind(7, run.created_us);
  insert->bind(8, to_string(run.state)).bind(9, run.recipe_sha256);
  if (Status done = insert->run(); !done) return done;
  run.number = database_.last_row_id();
  return {};
}

Status RunStore::keep_recipe(std::string_view sha256, std::string_view text) {
  auto insert = writing("INSERT OR IGNORE INTO recipe (sha256, text) VALUES (?, ?)");
  if (!insert) return pass(insert.error());
  insert->bind(1, sha256).bind(2, text);
  return insert->run();
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

Status RunStore::update(const StoredRun& run) {
  auto change = writing(
      "UPDATE run SET state=?, outcome=?, cleanup=?, rig_fact=?, error=?, dataset_sha256=?, "
      "folder=?, resume=?, recovered=?, bench=?, trials_done=?, trials_planned=?, dataset_error=?, "
      "rig_untaken=?, bench_outcome=?, bench_error=?, disk_bytes=? WHERE number=?");
  if (!change) return pass(change.error());
  const std::string folder = kept_folder(run.folder);
  change->bind(1, to_string(run.state)).bind(2, run.outcome).bind(3, run.cleanup);
  change->bind(4, run.rig_fact).bind(5, run.error).bind(6, run.dataset_sha256).bind(7, folder);
  change->bind(8, std::int64_t{run.resume}).bind(9, run.recovered).bind(10, run.bench);
  change->bind(11, run.trials_done).bind(12, run.trials_planned);
  change->bind(13, run.dataset_error).bind(14, std::int64_t{run.rig_untaken});
  change->bind(15, run.bench_outcome).bind(16, run.bench_error);
  change->bind(17, static_cast<std::int64_t>(run.disk_bytes)).bind(18, run.number);
  return change->run();
}

}  // namespace weft::daemon::control
