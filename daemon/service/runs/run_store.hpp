#pragma once
// What the daemon remembers of its runs over its own death: one SQLite file (WAL) with the runs and
// a journal of everything that somebody asked or that happened to them.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/service/runs/run_line.hpp"
#include "daemon/service/runs/run_machine.hpp"
#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon::control {

/// Who did what nobody asked for: the recipe, and a daemon that found what another had left.
inline constexpr const char* by_recipe = "auto:recipe";
inline constexpr const char* after_restart = "auto:restart";

/// Its name in the daemon's folder.
inline constexpr const char* store_file_name = "weftd.sqlite";

struct StoredRun {
  std::int64_t number = 0;
  std::filesystem::path recipe, rig, folder;
  std::string recipe_sha256;  ///< of the text that was checked; empty in older runs
  std::optional<std::uint64_t> seed;
  std::string name;
  std::string by;
  std::int64_t created_us = 0;  ///< UTC
  RunState state = RunState::queued;
  std::string outcome, cleanup, rig_fact;  ///< the three facts, once it has ended
  std::string error;                       ///< the first thing that went wrong
  /// Outcome and error of its newest turn at the bench; empty where it had none, or died in it.
  std::string bench_outcome, bench_error;
  std::string dataset_sha256;
  std::string dataset_error;  ///< why its record was not concluded, whatever became of the bench
  std::string bench;          ///< "simulated", "real"; empty where that is not known
  /// As they were when its state changed last; none where that is not known.
  std::optional<std::int64_t> trials_done, trials_planned;
  std::uint64_t disk_bytes = 0;  ///< that it needs to begin; 0 where that is not known
  bool resume = false;           ///< somebody asked to go on with what its folder holds
  /// What somebody decided about it after it was interrupted: "", "discard" or "keep-partial".
  std::string recovered;
  /// It is under way, and has not taken the rig yet: its death would leave that as it was.
  bool rig_untaken = false;

  [[nodiscard]] std::string id() const;  ///< "R-000318"
  /// Every trial is in a data set, however the bench came to its end after them.
  [[nodiscard]] bool has_all() const;
};

/// Whether the rig may be moved without somebody's word, and why not.
struct RigStanding {
  enum class Fact {
    safe,
    unknown,  ///< a run ended, or died, without knowing where it left the rig
    latched   ///< halted
  };
  Fact fact = Fact::safe;
  std::string why;  ///< who halted it, or which run left it so
  /// Latched by an emergency stop, which more than an operator's word releases.
  bool emergency = false;
  friend bool operator==(const RigStanding&, const RigStanding&) = default;
};
std::string_view to_string(RigStanding::Fact fact);

class RunStore {
 public:
  /// Opens or makes the file. A run's folder is kept by its way from the file's own folder where it
  /// lies in that: both may be moved together. Runs that were under way when the daemon died become
  /// `interrupted`, and the rig unknown, unless it was latched, or they had not taken it. Errors:
  /// io, corrupt; wrong_state, when another daemon has it.
  static Result<RunStore> open(const std::filesystem::path& file);

  /// The file, for what else is kept in it: it is locked, so that nobody opens it a second time.
  /// Lives as long as this store.
  [[nodiscard]] sqlite::Database& database() { return database_; }
  /// Errors: io, where the file was moved or removed meanwhile. Nothing is written down then: it
  /// would be lost.
  [[nodiscard]] Status in_place() const;
  [[nodiscard]] Result<std::vector<StoredRun>> load();
  /// All that `work` writes, or nothing of it: where it fails, or where it cannot be kept.
  Status together(const std::function<Status()>& work);
  /// Gives it its number.
  Status add(StoredRun& run);
  Status update(const StoredRun& run);
  /// The text of a recipe as it was checked, by its digest: the file may change while a run waits.
  Status keep_recipe(std::string_view sha256, std::string_view text);
  /// Errors: corrupt, where it is not there.
  [[nodiscard]] Result<std::string> recipe_text(std::string_view sha256);
  Status journal(std::int64_t utc_us, std::string_view run, std::string_view kind,
                 std::string_view by, std::string_view payload_json = "{}");

  [[nodiscard]] Result<RigStanding> standing();
  Status keep(const RigStanding& standing);

  /// The line as it was kept; empty in a new file.
  [[nodiscard]] Result<RunLine> line();
  /// All of it or nothing.
  Status keep(const RunLine& line);

  struct Line {
    std::int64_t sequence = 0, utc_us = 0;
    std::string run, kind, by, payload_json;
  };
  /// The newest `most` lines, oldest first; of one run where `run` is not empty.
  [[nodiscard]] Result<std::vector<Line>> tail(std::string_view run, std::size_t most);

  struct Query {
    std::string run, kind;  ///< empty: any
    std::int64_t since_us = 0,
                 until_us = std::numeric_limits<std::int64_t>::max();  ///< [since, until)
    std::int64_t from = 0;                                             ///< sequence
    std::size_t most = 100;                                            ///< lines
  };
  struct Page {
    std::vector<Line> lines;           ///< oldest first
    std::optional<std::int64_t> next;  ///< where to ask on from; nothing after the newest line
  };
  /// Looks at a bounded part of the journal, so that a question which few lines answer keeps nobody
  /// waiting: a page may be empty and have a next one.
  [[nodiscard]] Result<Page> query(const Query& wanted);

 private:
  RunStore(sqlite::Database database, std::filesystem::path home)
      : database_(std::move(database)), home_(std::move(home)) {}
  Status take_stock();
  Result<sqlite::Statement> writing(std::string_view sql);
  Status write(const RunLine& line);
  [[nodiscard]] std::string kept_folder(const std::filesystem::path& folder) const;
  [[nodiscard]] std::filesystem::path found_folder(const std::string& kept) const;
  sqlite::Database database_;
  std::filesystem::path home_;  ///< of the file, absolute; empty of one in memory
};

}  // namespace weft::daemon::control
