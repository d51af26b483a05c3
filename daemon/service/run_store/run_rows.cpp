// The tables of weftd.sqlite: runs, rig and queue as rows.

#include <algorithm>
#include <array>
#include <charconv>
#include <concepts>
#include <cstddef>
#include <tuple>
#include <type_traits>
#include <utility>

#include "daemon/service/run_store/run_store.hpp"

namespace weft::daemon::runs {
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
  disk_bytes INTEGER NOT NULL DEFAULT 0, keep_going INTEGER NOT NULL DEFAULT 0,
  had_ended INTEGER NOT NULL DEFAULT 0, user TEXT NOT NULL DEFAULT '',
  after_run INTEGER NOT NULL DEFAULT 0, promise TEXT NOT NULL DEFAULT '',
  fabrics TEXT NOT NULL DEFAULT '', tags TEXT NOT NULL DEFAULT '', note TEXT NOT NULL DEFAULT '',
  only_fabric TEXT NOT NULL DEFAULT ''
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
  id INTEGER PRIMARY KEY CHECK (id = 1), fact TEXT NOT NULL, why TEXT NOT NULL,
  left_by TEXT NOT NULL DEFAULT '', acknowledged INTEGER NOT NULL DEFAULT 0,
  latch TEXT NOT NULL DEFAULT '', lock_user TEXT NOT NULL DEFAULT '',
  lock_reason TEXT NOT NULL DEFAULT '', lock_us INTEGER NOT NULL DEFAULT 0
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

/// Names of the latches; older files have them in the column of the fact.
constexpr std::string_view halt_name = "halt", emergency_name = "estop", old_halt_name = "latched";

/// A column that older files lack.
struct LaterColumn {
  std::string_view table, name, type;
};
constexpr std::string_view as_text = "TEXT NOT NULL DEFAULT ''",
                           as_count = "INTEGER NOT NULL DEFAULT 0";
constexpr std::array<LaterColumn, 28> later_columns{{{"run", "resume", as_count},
                                                     {"run", "recovered", as_text},
                                                     {"run", "bench", as_text},
                                                     {"run", "trials_done", "INTEGER"},
                                                     {"run", "trials_planned", "INTEGER"},
                                                     {"run", "recipe_sha256", as_text},
                                                     {"run", "dataset_error", as_text},
                                                     {"run", "rig_untaken", as_count},
                                                     {"run", "bench_outcome", as_text},
                                                     {"run", "bench_error", as_text},
                                                     {"run", "disk_bytes", as_count},
                                                     {"run", "keep_going", as_count},
                                                     {"run", "had_ended", as_count},
                                                     {"run", "user", as_text},
                                                     {"run", "after_run", as_count},
                                                     {"run", "promise", as_text},
                                                     {"run", "fabrics", as_text},
                                                     {"run", "tags", as_text},
                                                     {"run", "note", as_text},
                                                     {"run", "only_fabric", as_text},
                                                     {"rig", "left_by", as_text},
                                                     {"rig", "acknowledged", as_count},
                                                     {"rig", "latch", as_text},
                                                     {"rig", "lock_user", as_text},
                                                     {"rig", "lock_reason", as_text},
                                                     {"rig", "lock_us", as_count},
                                                     {"answer", "token", as_text},
                                                     {"hand_over", "attempts", as_count}}};

// The request of a run is written once, its results are updated.
constexpr std::string_view read_sql =
    "SELECT number, recipe, rig, folder, seed, name, by, created_us, state, outcome, cleanup, "
    "rig_fact, error, dataset_sha256, resume, recovered, bench, trials_done, trials_planned, "
    "recipe_sha256, dataset_error, rig_untaken, bench_outcome, bench_error, disk_bytes, "
    "keep_going, had_ended, user, after_run, promise, fabrics, tags, note, only_fabric "
    "FROM run ORDER BY number";
constexpr std::string_view write_sql =
    "INSERT INTO run (number, recipe, rig, folder, seed, name, by, created_us, state, outcome, "
    "cleanup, rig_fact, error, dataset_sha256, resume, recovered, bench, trials_done, "
    "trials_planned, recipe_sha256, dataset_error, rig_untaken, bench_outcome, bench_error, "
    "disk_bytes, keep_going, had_ended, user, after_run, promise, fabrics, tags, note, "
    "only_fabric) VALUES "
    "(?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?,?) "
    "ON CONFLICT(number) DO UPDATE SET folder=excluded.folder, state=excluded.state, "
    "outcome=excluded.outcome, cleanup=excluded.cleanup, rig_fact=excluded.rig_fact, "
    "error=excluded.error, dataset_sha256=excluded.dataset_sha256, resume=excluded.resume, "
    "recovered=excluded.recovered, bench=excluded.bench, trials_done=excluded.trials_done, "
    "trials_planned=excluded.trials_planned, dataset_error=excluded.dataset_error, "
    "rig_untaken=excluded.rig_untaken, bench_outcome=excluded.bench_outcome, "
    "bench_error=excluded.bench_error, disk_bytes=excluded.disk_bytes, "
    "had_ended=excluded.had_ended, user=excluded.user, seed=excluded.seed, "
    "name=excluded.name, keep_going=excluded.keep_going, after_run=excluded.after_run, "
    "promise=excluded.promise, fabrics=excluded.fabrics, tags=excluded.tags, note=excluded.note";

/// The columns in the order of both statements.
template <class Run>
auto columns_of(Run& run) {
  return std::tie(run.number, run.recipe, run.rig, run.folder, run.seed, run.name, run.by,
                  run.created_us, run.state, run.outcome, run.cleanup, run.rig_fact, run.error,
                  run.dataset_sha256, run.resume, run.recovered, run.bench, run.trials_done,
                  run.trials_planned, run.recipe_sha256, run.dataset_error, run.rig_untaken,
                  run.bench_outcome, run.bench_error, run.disk_bytes, run.keep_going, run.had_ended,
                  run.user, run.after, run.promise, run.fabrics, run.tags, run.note,
                  run.only_fabric);
}

constexpr auto column_count = static_cast<std::ptrdiff_t>(
    std::tuple_size_v<decltype(columns_of(std::declval<StoredRun&>()))>);
static_assert(std::ranges::count(read_sql, ',') + 1 == column_count);
static_assert(std::ranges::count(write_sql, '?') == column_count);

/// Reads the columns of a row in their order.
struct RowReader {
  const sqlite::Statement& row;
  int column = 0;
  Status done = {};

  template <std::integral Number>
  void read(Number& to) {
    to = static_cast<Number>(row.integer(column++));
  }
  void read(std::string& to) { to = row.text(column++); }
  void read(std::filesystem::path& to) { to = row.text(column++); }
  void read(std::vector<std::string>& to) {
    const auto list = nlohmann::json::parse(row.text(column++), nullptr, false);
    if (list.is_array()) to = list.get<std::vector<std::string>>();
  }
  void read(std::optional<std::int64_t>& to) {
    if (!row.is_null(column)) to = row.integer(column);
    ++column;
  }
  void read(RunState& to) {
    const std::string name = row.text(column++);
    const auto* const found =
        std::ranges::find(all_run_states, name, [](RunState state) { return to_string(state); });
    if (found != all_run_states.end())
      to = *found;
    else
      done =
          fail({.code = Errc::corrupt, .where = "run", .what = "unknown run state", .got = name});
  }
  /// Empty: the recipe's seed is used.
  void read(std::optional<std::uint64_t>& to) {
    const std::string text = row.text(column++);
    if (text.empty()) return;
    const char* const end = text.data() + text.size();
    const auto read = std::from_chars(text.data(), end, to.emplace());
    if (read.ec == std::errc() && read.ptr == end) return;
    done = fail({.code = Errc::corrupt,
                 .where = "run",
                 .what = "invalid run seed",
                 .expected = "0 to 2^64 - 1",
                 .got = text});
  }
};

/// The value of a field for SQLite.
template <class Field>
auto to_sql(const Field& field) {
  if constexpr (std::is_integral_v<Field>)
    return static_cast<std::int64_t>(field);
  else if constexpr (std::is_same_v<Field, RunState>)
    return to_string(field);
  else if constexpr (std::is_same_v<Field, std::filesystem::path>)
    return field.string();
  else if constexpr (std::is_same_v<Field, std::vector<std::string>>)
    return field.empty() ? std::string() : nlohmann::json(field).dump();
  else if constexpr (std::is_same_v<Field, std::optional<std::uint64_t>>)  // exceeds SQLite's range
    return field ? std::to_string(*field) : std::string();
  else
    return field;
}

}  // namespace

Status RunStore::make_tables() {
  Status done = database_.execute(schema_sql);
  for (const auto& [table, name, type] : later_columns) {
    std::int64_t known = 0;
    if (done)
      done = for_rows(
          "SELECT count(*) FROM pragma_table_info(?) WHERE name = ?",
          [&](const auto& row) { known = row.integer(0); }, table, name);
    if (!done || known > 0) continue;
    std::string alter("ALTER TABLE ");
    alter.append(table).append(" ADD COLUMN ").append(name).append(" ").append(type);
    done = database_.execute(alter.c_str());
  }
  return done;
}

Result<sqlite::Statement> RunStore::prepare_runs(std::string_view condition) {
  std::string sql(read_sql.substr(0, read_sql.find(" ORDER BY")));
  return database_.prepare(sql.append(" ").append(condition));
}

Result<StoredRun> RunStore::read_run(const sqlite::Statement& row) {
  StoredRun run;
  RowReader reader{row};
  std::apply([&](auto&... column) { (reader.read(column), ...); }, columns_of(run));
  if (!reader.done) return pass(reader.done.error());
  return run;
}

Result<std::vector<StoredRun>> RunStore::collect(sqlite::Statement& rows,
                                                 bool (*is_wanted)(const StoredRun&)) {
  std::vector<StoredRun> out;
  Status valid;
  const Status done = rows.each([&](const sqlite::Statement& row) {
    auto run = read_run(row);
    if (!run) {
      if (valid) valid = pass(run.error());
    } else if (is_wanted == nullptr || is_wanted(*run)) {
      run->folder = found_folder(*run);
      out.push_back(*std::move(run));
    }
  });
  if (!valid) return pass(valid.error());
  if (!done) return pass(done.error());
  return out;
}

Result<std::vector<StoredRun>> RunStore::runs() {
  auto rows = prepare_runs("ORDER BY number");
  if (!rows) return pass(rows.error());
  return collect(*rows);
}

// The recipe is its file's name without ".json".
constexpr std::string_view is_found_sql =
    "(?4 = '' OR instr(lower(printf('R-%06d', number) || char(10) || replace(replace(recipe, "
    "rtrim(recipe, replace(recipe, '/', '')), ''), '.json', '') || char(10) || name || char(10) || "
    "fabrics || char(10) || tags || char(10) || note || char(10) || outcome), lower(?4)) > 0)";

Result<RunPage> RunStore::runs(const RunFilter& filter, std::optional<std::int64_t> cursor,
                               std::size_t limit) {
  std::string states;
  for (const RunState state : filter.states) states.append(" ").append(to_string(state));
  if (!states.empty()) states += ' ';
  const std::string_view order = filter.newest_first ? "number <= ?1 ORDER BY number DESC LIMIT ?3"
                                                     : "number >= ?1 ORDER BY number LIMIT ?3";
  auto rows = prepare_runs(std::string("WHERE (?2 = '' OR instr(?2, ' ' || state || ' ') > 0) AND ")
                               .append(is_found_sql)
                               .append(" AND ")
                               .append(order));
  if (!rows) return pass(rows.error());
  const std::int64_t first =
      cursor.value_or(filter.newest_first ? std::numeric_limits<std::int64_t>::max() : 0);
  auto found = collect(rows->bind_all(first, states, limit + 1, filter.search));
  if (!found) return pass(found.error());
  RunPage page{std::move(*found), {}};
  if (page.runs.size() <= limit) return page;
  page.next = page.runs.back().number;
  page.runs.pop_back();
  return page;
}

Result<std::optional<StoredRun>> RunStore::run(std::int64_t number) {
  if (!by_number_.is_prepared()) {
    auto prepared = prepare_runs("WHERE number = ?");
    if (!prepared) return pass(prepared.error());
    by_number_ = std::move(*prepared);
  }
  auto found = collect(by_number_.bind(1, number));
  if (!found) return pass(found.error());
  return found->empty() ? std::nullopt : std::optional(std::move(found->front()));
}

// The last condition: StoredRun::has_all() is false, and the run was not discarded.
Result<std::vector<StoredRun>> RunStore::recent_runs(std::size_t newest) {
  auto rows = prepare_runs(
      "WHERE state NOT IN ('ended', 'interrupted') OR "
      "(state = 'interrupted' AND trials_done IS NULL) OR number IN (SELECT number FROM run WHERE "
      "state IN ('ended', 'interrupted') ORDER BY number DESC LIMIT ?1) OR number IN (SELECT "
      "number FROM run WHERE state IN ('ended', 'interrupted') AND recovered <> 'discard' AND NOT "
      "(dataset_error = '' AND (outcome = 'complete' OR (dataset_sha256 <> '' AND trials_done IS "
      "NOT NULL AND trials_done IS trials_planned))) ORDER BY number DESC LIMIT ?1) "
      "ORDER BY number");
  if (!rows) return pass(rows.error());
  return collect(rows->bind(1, newest));
}

Status RunStore::write(const StoredRun& run) {
  StoredRun stored = run;
  stored.folder = stored_folder(run.folder);
  const auto write_columns = [this](const auto&... column) {
    return database_.run(write_sql, to_sql(column)...);
  };
  return std::apply(write_columns, columns_of(stored));
}

std::filesystem::path RunStore::stored_folder(const std::filesystem::path& folder) const {
  if (home_.empty() || folder.empty()) return folder;
  const auto way = make_absolute(folder).lexically_relative(home_);
  const bool is_within = !way.empty() && *way.begin() != ".." && way != ".";
  return is_within ? way : folder;
}

// Older daemons stored the folder as given: relative to their working folder, or absolute, which is
// wrong after a move. Then the folder's name is looked up here. A folder with another run's number
// was imported from elsewhere.
std::filesystem::path RunStore::found_folder(const StoredRun& run) const {
  const std::filesystem::path& folder = run.folder;
  if (home_.empty() || folder.empty()) return folder;
  if (folder.is_absolute() && folder_number(folder) != run.number) return folder;
  const std::filesystem::path here = home_ / folder.filename();
  std::error_code unseen;
  for (const auto& place : {folder.is_relative() ? home_ / folder : here, here})
    if (std::filesystem::exists(place, unseen)) return place;
  return home_ / folder;
}

Status RunStore::write(const RigState& rig) {
  const RigFacts& facts = rig.facts();
  const LockOut lock = facts.lock_out.value_or(LockOut{});
  const Latch latch = facts.latch.value_or(Latch{});
  const std::string_view latch_name = latch.is_emergency ? emergency_name : halt_name;
  return database_.run(
      "INSERT OR REPLACE INTO rig (id, fact, why, left_by, acknowledged, latch, lock_user, "
      "lock_reason, lock_us) VALUES (1, ?, ?, ?, ?, ?, ?, ?, ?)",
      to_string(facts.fact), latch.why, facts.left_by, std::int64_t{facts.acknowledged},
      facts.latch ? latch_name : std::string_view(), lock.user, lock.reason, lock.since_us);
}

Status RunStore::write(const RunQueue& queue) {
  Status done =
      database_.run("INSERT OR REPLACE INTO line (id, revision, held_by) VALUES (1, ?, ?)",
                    queue.revision(), queue.paused_by());
  if (done) done = database_.execute("DELETE FROM waiting");
  for (std::int64_t place = 0; const std::int64_t number : queue.runs())
    if (done)
      done = database_.run("INSERT INTO waiting (place, run) VALUES (?, ?)", place++, number);
  return done;
}

Result<RigState> RunStore::rig_state() {
  RigFacts out;
  Status valid;
  const Status read = database_.each(
      "SELECT fact, why, left_by, acknowledged, latch, lock_user, lock_reason, lock_us FROM rig",
      [&](const auto& row) {
        const std::string name = row.text(0), why = row.text(1), latch = row.text(4);
        const bool is_old_latch = name == old_halt_name || name == emergency_name;
        if (!is_old_latch && name != to_string(rig_fact_of(name)))
          valid = fail(
              {.code = Errc::corrupt, .where = "rig", .what = "unknown rig state", .got = name});
        out = {
            .fact = rig_fact_of(name), .left_by = row.text(2), .acknowledged = row.integer(3) != 0};
        if (is_old_latch || !latch.empty())
          out.latch = Latch{name == emergency_name || latch == emergency_name, why};
        else if (out.fact == RigFact::unknown && out.left_by.empty())
          out.left_by = why;  // from an older file
        if (const std::string user = row.text(5); !user.empty())
          out.lock_out = LockOut{user, row.text(6), row.integer(7)};
      });
  if (!valid) return pass(valid.error());
  if (!read) return pass(read.error());
  return RigState(std::move(out));
}

Result<RunQueue> RunStore::queue() {
  std::int64_t revision = 0;
  std::string paused_by;
  std::vector<RunQueue::Run> waiting;
  Status read = database_.each("SELECT revision, held_by FROM line", [&](const auto& row) {
    revision = row.integer(0);
    paused_by = row.text(1);
  });
  if (read)
    read = database_.each("SELECT run FROM waiting ORDER BY place",
                          [&](const auto& row) { waiting.push_back(row.integer(0)); });
  if (!read) return pass(read.error());
  return RunQueue(revision, std::move(paused_by), std::move(waiting));
}

}  // namespace weft::daemon::runs
