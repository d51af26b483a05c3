#pragma once
// What the daemon remembers of its runs over its own death: one SQLite file (WAL) with the runs,
// their queue, the rig and a journal of everything that people ordered or that happened.

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

/// 318 of "R-000318"; nothing of any other text.
std::optional<std::int64_t> run_number(std::string_view id);
/// 318 of a folder "R-000318" or "R-000318-name"; 0 of any other name.
std::int64_t folder_number(const std::filesystem::path& folder);

/// Who asks people for what the recipe wants.
inline constexpr const char* by_recipe = "auto:recipe";

/// Why the rig is unknown, if the catalogue was lost.
inline constexpr const char* without_catalogue = "auto:catalogue_lost";

/// Its name in the daemon's folder.
inline constexpr const char* store_file_name = "weftd.sqlite";

struct StoredRun : RunFacts {
  std::int64_t number = 0;
  std::filesystem::path recipe, rig, folder;
  std::string recipe_sha256;  ///< of the text that was checked; empty in older runs
  std::optional<std::uint64_t> seed;
  std::string name;
  std::string by;
  std::string user;             ///< who submitted or resumed it; empty where that is not known
  std::int64_t created_us = 0;  ///< UTC
  RunState state = RunState::queued;
  std::string bench;  ///< "simulated", "real"; empty where that is not known
  /// As they were when its state changed last; none where that is not known.
  std::optional<std::int64_t> trials_done, trials_planned;
  std::uint64_t disk_bytes = 0;  ///< that it needs to begin; 0 where that is not known
  bool resume = false;           ///< a person resumed it: it goes on with what its folder holds
  /// What a person decided after it was interrupted: "", "discard" or "keep-partial".
  std::string recovered;
  /// It is under way, and has not taken the rig yet: its death would leave that as it was.
  bool rig_untaken = false;
  bool keep_going = false;             ///< the queue goes on after it, see EndedRun
  std::int64_t after = 0;              ///< it begins once this run has ended complete; 0: none
  std::string fabrics = {};            ///< of its recipe, with spaces between; for a search
  std::vector<std::string> tags = {};  ///< a person's
  std::string note = {};               ///< a person's
  bool had_ended = false;  ///< it had ended when a person resumed it; else it was interrupted

  [[nodiscard]] std::string id() const { return run_id(number); }
  RunFacts& facts() { return *this; }
  /// Every trial is in a data set, however the bench came to its end after them.
  [[nodiscard]] bool has_all() const;
};

struct JournalLine {
  std::int64_t sequence = 0, utc_us = 0;
  std::string run, kind, by, payload_json = "{}";
};
/// The line of a run that has changed its state: the state and the seed; of one that is over also
/// how it ended.
JournalLine state_line(const StoredRun& run, std::int64_t utc_us, std::string_view by);

/// The text of a recipe as it was checked, by its digest: the file may change while a run waits.
struct CheckedRecipe {
  std::string sha256, text;
};

/// An error of opening the file that says that the file is damaged.
constexpr bool is_damage(Errc code) {
  return code == Errc::corrupt || code == Errc::parse;
}

/// What one event changes: all of it is written, or nothing.
struct RunChange {
  std::vector<StoredRun> runs = {};
  std::optional<RunQueue> queue = {};
  std::optional<RigState> rig = {};
  std::vector<JournalLine> journal = {};
  std::vector<CheckedRecipe> recipes = {};

  [[nodiscard]] bool is_empty() const;
  /// In place of what it has of that run.
  void put(const StoredRun& run);
  void add(const RunChange& later);
};

/// Which runs a page lists, and in which order.
struct RunFilter {
  std::vector<RunState> states = {};  ///< empty: any
  bool newest_first = false;
  /// Contained in its name R-000318, recipe, name, fabrics, tags, note or outcome; the case of
  /// ASCII letters does not matter. Empty: any.
  std::string search = {};
};
struct RunPage {
  std::vector<StoredRun> runs;
  std::optional<std::int64_t> next;  ///< number that the next page begins with, if any
};

class RunStore {
 public:
  /// Called once for each line of the journal: when it is written or, where it was refused, when it
  /// is kept to be written later (`is_written` is false then). Not when it is written at last.
  using JournalObserver = std::function<void(const JournalLine& line, bool is_written)>;

  /// Opens or makes the file. A run's folder is kept relative to the file's own folder where it
  /// lies in that: both may be moved together. Runs that were under way when the daemon died become
  /// `interrupted`, with a line of the journal, and the rig unknown, unless they had not taken it.
  /// The rig is unknown too in a new file beside folders of runs: the file before it was lost.
  /// Errors: io; corrupt or parse, with --rebuild-catalogue as the hint; busy, when another daemon
  /// has it. `on_line`: see JournalObserver.
  static Result<RunStore> open(const std::filesystem::path& file, JournalObserver on_line = {});

  /// The file, for what else is kept in it: it is locked, so that nothing opens it a second time.
  /// Lives as long as this store.
  [[nodiscard]] sqlite::Database& database() { return database_; }
  /// Errors: io, where the file was moved or removed meanwhile. Nothing is written then: it would
  /// be lost.
  [[nodiscard]] Status in_place() const;
  /// The runs that were under way when the daemon before this one ended without a word.
  [[nodiscard]] const std::vector<std::int64_t>& cut_by_restart() const { return cut_by_restart_; }

  /// One transaction, with what persist() could not write before. Errors: io; nothing of `change`
  /// is written then.
  Status commit(const RunChange& change);
  /// Of what has happened already: what is refused now is written with the next change. Rig, runs
  /// and queue are then tried without the journal.
  void persist(const RunChange& change);
  /// False: something that has happened is not written, and would be forgotten with the daemon.
  [[nodiscard]] bool is_persisted() const { return unwritten_.is_empty(); }
  /// commit() of one line.
  Status append_journal(std::int64_t utc_us, std::string_view run, std::string_view kind,
                        std::string_view by, std::string_view payload_json = "{}");

  [[nodiscard]] Result<std::vector<StoredRun>> runs();  ///< the oldest first
  static constexpr std::size_t no_limit = std::size_t{1} << 62;
  /// At most `limit` of them, from number `cursor` on; from the first of the order without it.
  [[nodiscard]] Result<RunPage> runs(const RunFilter& filter, std::optional<std::int64_t> cursor,
                                     std::size_t limit);
  [[nodiscard]] Result<std::optional<StoredRun>> run(std::int64_t number);
  /// Every run that is not over or whose trials are not counted, the `newest` that are over and the
  /// `newest` of which something is left to be recorded. The oldest first.
  [[nodiscard]] Result<std::vector<StoredRun>> recent_runs(std::size_t newest);
  /// How many runs are in each state, by its name.
  [[nodiscard]] Result<std::map<std::string, std::int64_t>> state_counts();
  /// That the next new run gets: above every run and every run's folder that was here when the
  /// store was opened. A number is never given twice.
  [[nodiscard]] Result<std::int64_t> next_number();
  /// No new run gets a number up to this one. Errors: io.
  Status skip_numbers(std::int64_t last);
  /// Errors: corrupt, where it is not there.
  [[nodiscard]] Result<std::string> recipe_text(std::string_view sha256);
  [[nodiscard]] Result<RigState> rig_state();  ///< safe in a new file
  [[nodiscard]] Result<RunQueue> queue();      ///< empty in a new file
  /// The newest `most` lines of the journal, oldest first; of one run where `run` is not empty.
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
    std::optional<std::int64_t> next;  ///< the sequence that the next page is from, if any
  };
  /// Looks at a bounded part of the journal, so that a question which few lines answer blocks
  /// nothing else: a page may be empty and have a next one.
  [[nodiscard]] Result<Page> query(const Query& wanted);

 private:
  RunStore(sqlite::Database database, std::filesystem::path home, JournalObserver on_line)
      : database_(std::move(database)), home_(std::move(home)), on_line_(std::move(on_line)) {}
  void report(const std::vector<JournalLine>& lines, bool is_written) const;
  Status check_pages();
  /// Makes what is not there; a file from before there was a column gets it.
  Status make_tables();
  Status recover_after_restart();
  Status check_folders();
  /// `condition`: what follows the table's name.
  Result<sqlite::Statement> prepare_runs(std::string_view condition);
  static Result<StoredRun> read_run(const sqlite::Statement& row);
  /// Runs to the last row. Errors: corrupt.
  Result<std::vector<StoredRun>> collect(sqlite::Statement& rows,
                                         bool (*is_wanted)(const StoredRun&) = nullptr);
  static std::filesystem::path make_absolute(const std::filesystem::path& folder);
  [[nodiscard]] std::filesystem::path stored_folder(const std::filesystem::path& folder) const;
  [[nodiscard]] std::filesystem::path found_folder(const StoredRun& run) const;
  /// All of `changes` or nothing.
  Status transact(std::initializer_list<const RunChange*> changes);
  Status write(const RunChange& change);
  Status write(const CheckedRecipe& recipe);
  Status write(const StoredRun& run);
  Status write(const RunQueue& queue);
  Status write(const RigState& rig);
  Status write(const JournalLine& line);
  /// The one that a statement returns.
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
  std::filesystem::path home_;       ///< of the file, absolute; empty of one in memory
  std::int64_t highest_folder_ = 0;  ///< the highest number of a run's folder in it
  sqlite::Statement by_number_;      ///< prepared at its first use
  RunChange unwritten_;
  JournalObserver on_line_;
};

}  // namespace weft::daemon::runs
