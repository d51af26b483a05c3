#include "daemon/service/run_store/run_rows.hpp"

#include <algorithm>
#include <charconv>

namespace weft::daemon::runs {
namespace {

enum class Column : std::uint8_t { fixed, changes };

/// Each column of the table, for reading and writing: its name, what it holds, and whether it is
/// written once.
template <class Run, class Visit>
void visit_columns(Run& run, Visit&& visit) {
  using enum Column;
  visit("number", run.number, fixed);
  visit("recipe", run.recipe, fixed);
  visit("rig", run.rig, fixed);
  visit("folder", run.folder, changes);
  visit("seed", run.seed, fixed);
  visit("name", run.name, fixed);
  visit("by", run.by, fixed);
  visit("created_us", run.created_us, fixed);
  visit("state", run.state, changes);
  visit("outcome", run.outcome, changes);
  visit("cleanup", run.cleanup, changes);
  visit("rig_fact", run.rig_fact, changes);
  visit("error", run.error, changes);
  visit("dataset_sha256", run.dataset_sha256, changes);
  visit("resume", run.resume, changes);
  visit("recovered", run.recovered, changes);
  visit("bench", run.bench, changes);
  visit("trials_done", run.trials_done, changes);
  visit("trials_planned", run.trials_planned, changes);
  visit("recipe_sha256", run.recipe_sha256, fixed);
  visit("dataset_error", run.dataset_error, changes);
  visit("rig_untaken", run.rig_untaken, changes);
  visit("bench_outcome", run.bench_outcome, changes);
  visit("bench_error", run.bench_error, changes);
  visit("disk_bytes", run.disk_bytes, changes);
}

struct RunSql {
  std::string select = "SELECT ", write = "INSERT INTO run (";
};

const RunSql& run_sql() {
  static const RunSql sql = [] {
    std::string names, places, changes;
    const StoredRun any;
    visit_columns(any, [&](const std::string& name, const auto&, Column column) {
      names += (names.empty() ? "" : ", ") + name;
      places += places.empty() ? "?" : ",?";
      if (column == Column::changes)
        changes += (changes.empty() ? "" : ", ") + name + "=excluded." + name;
    });
    RunSql out;
    out.select += names + " FROM run ORDER BY number";
    out.write += names + ") VALUES (" + places + ") ON CONFLICT(number) DO UPDATE SET " + changes;
    return out;
  }();
  return sql;
}

/// Reads the columns of a row in their order.
struct RowReader {
  const sqlite::Statement& row;
  int column = 0;
  Status done = {};

  void read(std::int64_t& to) { to = row.integer(column); }
  void read(std::uint64_t& to) { to = static_cast<std::uint64_t>(row.integer(column)); }
  void read(bool& to) { to = row.integer(column) != 0; }
  void read(std::string& to) { to = row.text(column); }
  void read(std::filesystem::path& to) { to = row.text(column); }
  void read(std::optional<std::int64_t>& to) {
    if (!row.is_null(column)) to = row.integer(column);
  }
  void read(RunState& to) {
    const std::string name = row.text(column);
    const auto* const found = std::ranges::find(all_run_states, name, &to_name);
    if (found != all_run_states.end())
      to = *found;
    else
      done = fail({.code = Errc::corrupt,
                   .where = "run",
                   .what = "a run in no state that there is",
                   .got = name});
  }
  /// Nothing where the recipe's is taken.
  void read(std::optional<std::uint64_t>& to) {
    const std::string text = row.text(column);
    if (text.empty()) return;
    const char* const end = text.data() + text.size();
    const auto read = std::from_chars(text.data(), end, to.emplace());
    if (read.ec == std::errc() && read.ptr == end) return;
    done = fail({.code = Errc::corrupt,
                 .where = "run",
                 .what = "a run with a seed that is none",
                 .expected = "0 to 2^64 - 1",
                 .got = text});
  }
  static std::string_view to_name(RunState state) { return to_string(state); }
};

/// Binds the columns of a run in their order; holds the text until it is written.
struct RowBinder {
  sqlite::Statement& row;
  int column = 1;
  std::vector<std::string> texts = {};

  void bind(std::int64_t value) { row.bind(column, value); }
  void bind(std::uint64_t value) { row.bind(column, static_cast<std::int64_t>(value)); }
  void bind(bool value) { row.bind(column, std::int64_t{value}); }
  void bind(const std::optional<std::int64_t>& value) { row.bind(column, value); }
  void bind(const std::string& value) { row.bind(column, value); }
  void bind(RunState value) { row.bind(column, to_string(value)); }
  void bind(const std::filesystem::path& value) { hold(value.string()); }
  void bind(const std::optional<std::uint64_t>& value) {
    hold(value ? std::to_string(*value) : std::string());
  }
  void hold(std::string text) {
    texts.push_back(std::move(text));
    row.bind(column, texts.back());
  }
};

std::filesystem::path stored_folder(const std::filesystem::path& folder,
                                    const std::filesystem::path& home) {
  if (home.empty() || folder.empty()) return folder;
  std::error_code none;
  const auto absolute = std::filesystem::absolute(folder, none);
  const auto way = (none ? folder : absolute.lexically_normal()).lexically_relative(home);
  const bool is_within = !way.empty() && *way.begin() != ".." && way != ".";
  return is_within ? way : folder;
}

// Older daemons kept what they were given: relative to where they were started, or absolute, which
// holds until the folder is moved. Then its name is looked for here.
std::filesystem::path found_folder(const std::filesystem::path& folder,
                                   const std::filesystem::path& home) {
  if (home.empty() || folder.empty()) return folder;
  const std::filesystem::path here = home / folder.filename();
  std::error_code unseen;
  for (const auto& place : {folder.is_relative() ? home / folder : here, here})
    if (std::filesystem::exists(place, unseen)) return place;
  return home / folder;
}

}  // namespace

Result<std::vector<StoredRun>> read_runs(sqlite::Database& database,
                                         const std::filesystem::path& home) {
  auto query = database.prepare(run_sql().select);
  if (!query) return pass(query.error());
  std::vector<StoredRun> out;
  for (;;) {
    const auto row = query->step();
    if (!row) return pass(row.error());
    if (!*row) return out;
    StoredRun& run = out.emplace_back();
    RowReader reader{*query};
    visit_columns(run, [&](const char*, auto& to, Column) {
      reader.read(to);
      ++reader.column;
    });
    if (!reader.done) return pass(reader.done.error());
    run.folder = found_folder(run.folder, home);
  }
}

Status write_run(sqlite::Database& database, const std::filesystem::path& home,
                 const StoredRun& run) {
  auto change = database.prepare(run_sql().write);
  if (!change) return pass(change.error());
  StoredRun kept = run;
  kept.folder = stored_folder(run.folder, home);
  RowBinder binder{*change};
  binder.texts.reserve(8);  // bound text stays where it is
  visit_columns(kept, [&](const char*, const auto& value, Column) {
    binder.bind(value);
    ++binder.column;
  });
  return change->run();
}

}  // namespace weft::daemon::runs
