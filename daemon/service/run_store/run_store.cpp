#include "daemon/service/run_store/run_store.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <nlohmann/json.hpp>
#include <system_error>

#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/campaign/resume.hpp"

namespace weft::daemon::runs {
namespace {

// Full synchronisation: acknowledged changes survive a power failure.
constexpr const char* opening_sql =
    "PRAGMA locking_mode=EXCLUSIVE; PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;"
    "BEGIN IMMEDIATE; COMMIT;";

constexpr std::int64_t most_searched = 20'000;  // journal lines

/// Checked first, because SQLite reports a read-only folder as a locking error.
Status check_folder(const std::filesystem::path& folder) {
  if (folder.empty() || ::access(folder.c_str(), W_OK) == 0) return {};
  const std::error_code why(errno, std::generic_category());
  return fail({.code = Errc::io,
               .where = folder.string(),
               .what = "folder not writable",
               .got = why.message(),
               .hint = "Give the daemon a folder of its own that it can write to"});
}

/// A damaged file is never replaced without a person's order.
Error with_way_out(Error error) {
  if (is_damage(error.code))
    error.hint =
        "Start weftd once with the same options and --rebuild-catalogue: it renames this file "
        "and reads the runs from their folders";
  return error;
}

bool was_under_way(const StoredRun& run) {
  return run.state != RunState::queued && run.state != RunState::ended &&
         run.state != RunState::interrupted;
}

/// Nothing was moved or recorded; the data set of an earlier record may be finished.
void cut_before_rig(StoredRun& run, const RigState& rig) {
  if (run.outcome.empty()) {
    run.outcome = "interrupted";
    run.cleanup = "skipped";
    run.trials_done = 0;
  }
  run.rig_fact = to_string(rig.facts().fact);
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
  run.facts() = {.outcome = "interrupted",
                 .cleanup = "skipped",
                 .rig_fact = "unknown",
                 .dataset_sha256 = certified_dataset(run.folder)};
}

JournalLine line_of(const sqlite::Statement& row) {
  return {row.integer(0), row.integer(1), row.text(2), row.text(3), row.text(4), row.text(5)};
}

}  // namespace

std::optional<std::int64_t> run_number(std::string_view id) {
  std::int64_t number = 0;
  constexpr std::size_t longest = 14;
  if (!id.starts_with("R-") || id.size() > longest) return std::nullopt;
  std::from_chars(id.data() + 2, id.data() + id.size(), number);
  return number > 0 && run_id(number) == id ? std::optional(number) : std::nullopt;
}

std::int64_t folder_number(const std::filesystem::path& folder) {
  const std::string name = folder.filename();
  return run_number(name.substr(0, name.find('-', 2))).value_or(0);
}

bool StoredRun::has_all() const {
  if (!dataset_error.empty() || recovered == "discard") return false;
  const bool counted = trials_done && trials_done == trials_planned;
  return outcome == "complete" || (counted && !dataset_sha256.empty());
}

JournalLine state_line(const StoredRun& run, std::int64_t utc_us, std::string_view by) {
  nlohmann::json payload{{"state", to_string(run.state)}};
  if (run.seed) payload["seed"] = *run.seed;
  if (run.state == RunState::ended || run.state == RunState::interrupted) {
    payload.update({{"outcome", run.outcome}, {"cleanup", run.cleanup}, {"rig", run.rig_fact}});
    if (run.trials_done) payload["trials_done"] = *run.trials_done;
    if (run.trials_planned) payload["trials_planned"] = *run.trials_planned;
    if (!run.error.empty()) payload["error"] = run.error;
    if (!run.dataset_error.empty()) payload["dataset_error"] = run.dataset_error;
    if (!run.dataset_sha256.empty()) payload["dataset_sha256"] = run.dataset_sha256;
  }
  return {0,
          utc_us,
          run.id(),
          "state",
          std::string(by),
          payload.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)};
}

bool RunChange::is_empty() const {
  return runs.empty() && !queue && !rig && journal.empty() && recipes.empty();
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
  recipes.insert(recipes.end(), later.recipes.begin(), later.recipes.end());
  journal.insert(journal.end(), later.journal.begin(), later.journal.end());
}

Result<RunStore> RunStore::open(const std::filesystem::path& file, JournalObserver on_line) {
  const std::filesystem::path folder = file.parent_path();
  if (Status usable = check_folder(folder); !usable) return pass(usable.error());
  auto database = sqlite::Database::open(file, sqlite::Mode::create);
  if (!database) return pass(with_way_out(database.error()), file.string());
  if (const Status alone = database->execute(opening_sql); !alone) {
    if (alone.error().code != Errc::busy) return pass(with_way_out(alone.error()), file.string());
    return fail({.code = Errc::busy,
                 .where = file.string(),
                 .what = "folder in use by another weftd",
                 .hint = "Stop it, or choose another folder"});
  }
  RunStore store(std::move(*database),
                 file == ":memory:" ? std::filesystem::path() : make_absolute(folder),
                 std::move(on_line));
  Status ok = store.check_pages();
  if (ok) ok = store.make_tables();
  if (ok) ok = store.check_folders();
  if (ok) ok = store.recover_after_restart();
  if (!ok) return pass(with_way_out(ok.error()), file.string());
  return store;
}

std::filesystem::path RunStore::make_absolute(const std::filesystem::path& folder) {
  std::error_code none;
  auto absolute = std::filesystem::absolute(folder.empty() ? "." : folder, none);
  return none ? folder : absolute.lexically_normal();
}

/// SQLite checks every page now: damage that is found later would fail a run.
Status RunStore::check_pages() {
  std::string found;
  Status read =
      database_.each("PRAGMA quick_check(1)", [&](const auto& row) { found = row.text(0); });
  if (!read || found == "ok") return read;
  return fail({.code = Errc::corrupt, .what = "catalogue of runs damaged", .got = found});
}

// Folders of runs beside an empty catalogue: the catalogue was lost, and with it the rig's state.
Status RunStore::check_folders() {
  if (home_.empty()) return {};
  std::error_code unreadable;
  for (const auto& entry : std::filesystem::directory_iterator(home_, unreadable))
    highest_folder_ = std::max(highest_folder_, folder_number(entry.path()));
  const auto lines = find_number("SELECT count(*) FROM (SELECT 1 FROM journal LIMIT 1)");
  const auto runs = find_number("SELECT count(*) FROM sqlite_sequence WHERE name = 'run'");
  if (!lines || !runs) return pass(lines ? runs.error() : lines.error());
  if (highest_folder_ == 0 || *lines + *runs > 0) return {};
  return commit({.rig = RigState(RigFact::unknown, without_catalogue)});
}

// Reads every row, so that a corrupt one is found now.
Status RunStore::recover_after_restart() {
  auto rows = prepare_runs("");
  if (!rows) return pass(rows.error());
  const auto known = collect(*rows, was_under_way);
  if (!known) return pass(known.error());
  const auto before = rig_state();
  if (!before) return pass(before.error());
  const auto newest = tail("", 1);
  if (!newest) return pass(newest.error());
  // Journal times increase with their numbers, even after the clock was set back.
  const std::int64_t utc_us =
      std::max(utc_now().count() / 1000, newest->empty() ? 0 : newest->front().utc_us);
  RunChange change;
  for (StoredRun run : *known) {
    const bool acquired_rig = !std::exchange(run.rig_untaken, false);
    if (acquired_rig)
      cut_on_rig(run);
    else
      cut_before_rig(run, *before);
    run.state = RunState::interrupted;
    if (acquired_rig) {
      change.rig = *before;
      change.rig->on_ended(RigFact::unknown, run.id());
    }
    change.put(run);
    change.journal.push_back(state_line(run, utc_us, after_restart));
    cut_by_restart_.push_back(run.number);
  }
  return change.is_empty() ? Status() : commit(change);
}

Status RunStore::in_place() const {
  if (!database_.has_moved()) return {};
  return fail({.code = Errc::io,
               .where = (home_ / store_file_name).string(),
               .what = "database of the daemon no longer in its folder",
               .expected = "the file that was opened",
               .got = "moved or removed",
               .hint = "Put it back, or restart weftd: further changes would be lost"});
}

Status RunStore::commit(const RunChange& change) {
  const Status done = transact({&unwritten_, &change});
  if (!done) return done;
  unwritten_ = {};
  report(change.journal, true);
  return done;
}

void RunStore::report(const std::vector<JournalLine>& lines, bool is_written) const {
  if (!on_line_) return;
  for (const JournalLine& line : lines) on_line_(line, is_written);
}

// A full disk may have space for the rig's row but not for the journal. Without this a daemon that
// dies then would lose a latch.
void RunStore::persist(const RunChange& change) {
  if ((change.is_empty() && is_persisted()) || commit(change)) return;
  report(change.journal, false);
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
  // ROLLBACK fails harmlessly if SQLite has already rolled back, as on a full disk.
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
  const auto write_each = [&](const auto& items) {
    for (auto item = items.begin(); done && item != items.end(); ++item) done = write(*item);
  };
  write_each(change.recipes);
  if (done && change.rig) done = write(*change.rig);
  write_each(change.runs);
  if (done && change.queue) done = write(*change.queue);
  write_each(change.journal);
  return done;
}

Status RunStore::write(const CheckedRecipe& recipe) {
  return database_.run("INSERT OR IGNORE INTO recipe (sha256, text) VALUES (?, ?)", recipe.sha256,
                       recipe.text);
}

Status RunStore::write(const JournalLine& line) {
  return database_.run(
      "INSERT INTO journal (utc_us, run, kind, by, payload_json) VALUES (?,?,?,?,?)", line.utc_us,
      line.run, line.kind, line.by, line.payload_json);
}

Result<std::int64_t> RunStore::find_number(std::string_view sql) {
  std::int64_t number = 0;
  const Status read = database_.each(sql, [&](const auto& row) { number = row.integer(0); });
  if (!read) return pass(read.error());
  return number;
}

Result<std::int64_t> RunStore::next_number() {
  const auto last =
      find_number("SELECT coalesce(max(seq), 0) FROM sqlite_sequence WHERE name = 'run'");
  if (!last) return last;
  return std::max(*last, highest_folder_) + 1;
}

// SQLite creates the table's row with the first run.
Status RunStore::skip_numbers(std::int64_t last) {
  const Status added = database_.run(
      "INSERT INTO sqlite_sequence (name, seq) SELECT 'run', ? WHERE NOT EXISTS (SELECT 1 FROM "
      "sqlite_sequence WHERE name = 'run')",
      last);
  if (!added) return added;
  return database_.run("UPDATE sqlite_sequence SET seq = max(seq, ?) WHERE name = 'run'", last);
}

Result<std::map<std::string, std::int64_t>> RunStore::state_counts() {
  std::map<std::string, std::int64_t> out;
  const Status read =
      database_.each("SELECT state, count(*) FROM run GROUP BY state",
                     [&](const auto& row) { out.emplace(row.text(0), row.integer(1)); });
  if (!read) return pass(read.error());
  return out;
}

Result<std::string> RunStore::recipe_text(std::string_view sha256) {
  std::optional<std::string> text;
  const Status read = for_rows(
      "SELECT text FROM recipe WHERE sha256 = ?", [&](const auto& row) { text = row.text(0); },
      sha256);
  if (!read) return pass(read.error());
  if (text) return *std::move(text);
  return fail({.code = Errc::corrupt,
               .where = "recipe",
               .what = "recipe of the run missing",
               .expected = std::string(sha256)});
}

Result<std::vector<JournalLine>> RunStore::tail(std::string_view run, std::size_t most) {
  std::vector<JournalLine> lines;
  const Status read = for_rows(
      "SELECT sequence, utc_us, run, kind, by, payload_json FROM journal "
      "WHERE ?1 = '' OR run = ?1 ORDER BY sequence DESC LIMIT ?2",
      [&](const auto& row) { lines.push_back(line_of(row)); }, run,
      static_cast<std::int64_t>(most));
  if (!read) return pass(read.error());
  std::reverse(lines.begin(), lines.end());
  return lines;
}

Result<RunStore::Page> RunStore::query(const Query& wanted) {
  const auto last = find_number("SELECT coalesce(max(sequence), 0) FROM journal");
  if (!last) return pass(last.error());
  const std::int64_t from = std::clamp<std::int64_t>(wanted.from, 1, *last + 1);
  const std::int64_t end = std::min(*last + 1, from + most_searched);
  Page page;
  const Status read = for_rows(
      "SELECT sequence, utc_us, run, kind, by, payload_json FROM journal WHERE sequence >= ?1 AND "
      "sequence < ?2 AND (?3 = '' OR run = ?3) AND (?4 = '' OR instr(',' || ?4 || ',', ',' || kind "
      "|| "
      "',') > 0) AND utc_us >= ?5 AND "
      "utc_us < ?6 ORDER BY sequence LIMIT ?7",
      [&](const auto& row) { page.lines.push_back(line_of(row)); }, from, end, wanted.run,
      wanted.kind, wanted.since_us, wanted.until_us, static_cast<std::int64_t>(wanted.most));
  if (!read) return pass(read.error());
  const bool full = page.lines.size() == wanted.most;
  const std::int64_t next = full ? page.lines.back().sequence + 1 : end;
  if (next <= *last) page.next = next;
  return page;
}

}  // namespace weft::daemon::runs
