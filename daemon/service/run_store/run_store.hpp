#pragma once
// The daemon's persistent memory: one SQLite file (WAL) with the runs, their queue, the rig, and a
// journal of all orders and events.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "daemon/service/run_model/run_queue.hpp"
#include "daemon/service/run_model/run_state.hpp"
#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon::runs {

/// 318 for "R-000318"; empty for any other text.
std::optional<std::int64_t> run_number(std::string_view id);
/// 318 for a folder "R-000318" or "R-000318-name"; 0 for any other name.
std::int64_t folder_number(const std::filesystem::path& folder);

/// Author of operator prompts from the recipe.
inline constexpr const char* by_recipe = "auto:recipe";

/// Why the rig is unknown after the catalogue was lost.
inline constexpr const char* without_catalogue = "auto:catalogue_lost";

/// File name in the daemon's folder.
inline constexpr const char* store_file_name = "weftd.sqlite";

struct StoredRun : RunFacts {
  std::int64_t number = 0;
  std::filesystem::path recipe, rig, folder;
  std::string recipe_sha256;  ///< of the checked text; empty in older runs
  std::optional<std::uint64_t> seed;
  std::string name;
  std::string by;
  std::string user;             ///< user that submitted or resumed it; empty if unknown
  std::int64_t created_us = 0;  ///< UTC
  RunState state = RunState::queued;
  std::string bench;  ///< "simulated", "real"; empty if unknown
  /// Trial counts at its last change of state; empty if unknown.
  std::optional<std::int64_t> trials_done, trials_planned;
  std::uint64_t disk_bytes = 0;  ///< needed to start; 0 if unknown
  bool resume = false;           ///< a person resumed it: it continues the record in its folder
  /// A person's decision after it was interrupted: "", "discard" or "keep-partial".
  std::string recovered;
  /// Active, but has not acquired the rig: if the daemon dies now, the rig is unchanged.
  bool rig_untaken = false;
  bool keep_going = false;             ///< the queue continues after it, see EndedRun
  std::int64_t after = 0;              ///< starts once this run has ended complete; 0: none
  std::string fabrics = {};            ///< of its recipe, separated by spaces; for a search
  std::vector<std::string> tags = {};  ///< a person's
  std::string note = {};               ///< a person's
  std::string only_fabric = {};        ///< see CampaignRequest::only_fabric; empty: all
  bool had_ended = false;  ///< it had ended when a person resumed it; otherwise it was interrupted

  [[nodiscard]] std::string id() const { return run_id(number); }
  RunFacts& facts() { return *this; }
  /// Every trial is in a data set, whatever happened on the bench afterwards.
  [[nodiscard]] bool has_all() const;
};

struct JournalLine {
  std::int64_t sequence = 0, utc_us = 0;
  std::string run, kind, by, payload_json = "{}";
};
/// Journal line of a state change: state and seed; for an ended run also how it ended.
JournalLine state_line(const StoredRun& run, std::int64_t utc_us, std::string_view by);

/// Text of a recipe as checked, by its digest: the file may change while a run is queued.
struct CheckedRecipe {
  std::string sha256, text;
};

/// True for errors of opening the file that mean damage.
constexpr bool is_damage(Errc code) {
  return code == Errc::corrupt || code == Errc::parse;
}

/// Changes of one event; written in one transaction.
struct RunChange {
  std::vector<StoredRun> runs = {};
  std::optional<RunQueue> queue = {};
  std::optional<RigState> rig = {};
  std::vector<JournalLine> journal = {};
  std::vector<CheckedRecipe> recipes = {};

  [[nodiscard]] bool is_empty() const;
  /// Adds the run, or replaces its entry.
  void put(const StoredRun& run);
  void add(const RunChange& later);
};

/// The runs that a page lists, and their order.
struct RunFilter {
  std::vector<RunState> states = {};  ///< empty: any
  bool newest_first = false;
  /// Text in its id (R-000318), recipe, name, fabrics, tags, note or outcome. Ignores the case of
  /// ASCII letters. Empty: any.
  std::string search = {};
};
struct RunPage {
  std::vector<StoredRun> runs;
  std::optional<std::int64_t> next;  ///< number of the first run of the next page, if any
};

class RunStore {
 public:
  /// Called once per journal line: when it is written, or when the write fails and is postponed
  /// (`is_written` false). Not called again for the later write.
  using JournalObserver = std::function<void(const JournalLine& line, bool is_written)>;

  /// Opens or makes the file. A run's folder inside the file's folder is stored relative to it, so
  /// that both can be moved together. Runs that were active when the daemon died become
  /// `interrupted`, with a journal line. The rig becomes unknown, unless they had not acquired it.
  /// The rig is unknown too in a new file beside folders of runs: the previous file was lost.
  /// Errors: io; corrupt or parse, with --rebuild-catalogue as the hint; busy, another daemon uses
  /// it. `on_line`: see JournalObserver.
  static Result<RunStore> open(const std::filesystem::path& file, JournalObserver on_line = {});

  /// The file, for other tables: it is locked, so it cannot be opened a second time. Valid as long
  /// as this store.
  [[nodiscard]] sqlite::Database& database() { return database_; }
  /// Errors: io, if the file was moved or removed. Then nothing is written, because it would be
  /// lost.
  [[nodiscard]] Status in_place() const;
  /// Runs that were active when the previous daemon died.
  [[nodiscard]] const std::vector<std::int64_t>& cut_by_restart() const { return cut_by_restart_; }

  /// Writes `change` in one transaction with earlier changes that persist() could not write.
  /// Errors: io; then nothing of `change` is written.
  Status commit(const RunChange& change);
  /// For changes that have already happened: if the write fails, they are written with the next
  /// change. Rig, runs and queue are then tried without the journal.
  void persist(const RunChange& change);
  /// False: a change that has happened is not yet written and would be lost with the daemon.
  [[nodiscard]] bool is_persisted() const { return unwritten_.is_empty(); }
  /// commit() of one line.
  Status append_journal(std::int64_t utc_us, std::string_view run, std::string_view kind,
                        std::string_view by, std::string_view payload_json = "{}");

  [[nodiscard]] Result<std::vector<StoredRun>> runs();  ///< oldest first
  static constexpr std::size_t no_limit = std::size_t{1} << 62;
  /// At most `limit` runs, from number `cursor` on; without it from the first of the order.
  [[nodiscard]] Result<RunPage> runs(const RunFilter& filter, std::optional<std::int64_t> cursor,
                                     std::size_t limit);
  [[nodiscard]] Result<std::optional<StoredRun>> run(std::int64_t number);
  /// All runs that are not over or have no trial count, the `newest` ended ones, and the `newest`
  /// with an unfinished record. Oldest first.
  [[nodiscard]] Result<std::vector<StoredRun>> recent_runs(std::size_t newest);
  /// Number of runs in each state, by the state's name.
  [[nodiscard]] Result<std::map<std::string, std::int64_t>> state_counts();
  /// Number of the next new run: above every run, and above every run's folder at the time of
  /// opening. A number is never given twice.
  [[nodiscard]] Result<std::int64_t> next_number();
  /// Reserves numbers up to `last`. Errors: io.
  Status skip_numbers(std::int64_t last);
  /// Errors: corrupt, if it is missing.
  [[nodiscard]] Result<std::string> recipe_text(std::string_view sha256);
  [[nodiscard]] Result<RigState> rig_state();  ///< safe in a new file
  [[nodiscard]] Result<RunQueue> queue();      ///< empty in a new file
  /// The newest `most` journal lines, oldest first; only of `run` if it is not empty.
  [[nodiscard]] Result<std::vector<JournalLine>> tail(std::string_view run, std::size_t most);

  struct Query {
    std::string run, kind;  ///< empty: any; kinds are separated by commas
    std::int64_t since_us = 0,
                 until_us = std::numeric_limits<std::int64_t>::max();  ///< [since, until)
    std::int64_t from = 0;                                             ///< sequence
    std::size_t most = 100;                                            ///< lines
  };
  struct Page {
    std::vector<JournalLine> lines;    ///< oldest first
    std::optional<std::int64_t> next;  ///< first sequence of the next page, if any
  };
  /// Searches a bounded part of the journal, so that a rare match does not block other work. A page
  /// may be empty and still have a next one.
  [[nodiscard]] Result<Page> query(const Query& wanted);

 private:
  RunStore(sqlite::Database database, std::filesystem::path home, JournalObserver on_line)
      : database_(std::move(database)), home_(std::move(home)), on_line_(std::move(on_line)) {}
  void report(const std::vector<JournalLine>& lines, bool is_written) const;
  Status check_pages();
  /// Creates missing tables, and adds missing columns to an older file.
  Status make_tables();
  Status recover_after_restart();
  Status check_folders();
  /// `condition`: the SQL after the table's name.
  Result<sqlite::Statement> prepare_runs(std::string_view condition);
  static Result<StoredRun> read_run(const sqlite::Statement& row);
  /// Reads all rows. Errors: corrupt.
  Result<std::vector<StoredRun>> collect(sqlite::Statement& rows,
                                         bool (*is_wanted)(const StoredRun&) = nullptr);
  static std::filesystem::path make_absolute(const std::filesystem::path& folder);
  [[nodiscard]] std::filesystem::path stored_folder(const std::filesystem::path& folder) const;
  [[nodiscard]] std::filesystem::path found_folder(const StoredRun& run) const;
  /// Writes all of `changes` or nothing.
  Status transact(std::initializer_list<const RunChange*> changes);
  Status write(const RunChange& change);
  Status write(const CheckedRecipe& recipe);
  Status write(const StoredRun& run);
  Status write(const RunQueue& queue);
  Status write(const RigState& rig);
  Status write(const JournalLine& line);
  /// The number that a statement returns.
  Result<std::int64_t> find_number(std::string_view sql);
  /// As sqlite::Database::each(), with `values` bound in their order.
  template <class OnRow, class... Values>
  Status for_rows(std::string_view sql, OnRow on_row, const Values&... values) {
    auto statement = database_.prepare(sql);
    if (!statement) return pass(std::move(statement).error());
    return statement->bind_all(values...).each(std::move(on_row));
  }

  sqlite::Database database_;
  std::vector<std::int64_t> cut_by_restart_;
  std::filesystem::path home_;       ///< folder of the file, absolute; empty for one in memory
  std::int64_t highest_folder_ = 0;  ///< the highest number of a run's folder in it
  sqlite::Statement by_number_;      ///< prepared at its first use
  RunChange unwritten_;
  JournalObserver on_line_;
};

}  // namespace weft::daemon::runs
