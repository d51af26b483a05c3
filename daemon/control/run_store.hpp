#pragma once
// What the daemon remembers of its runs over its own death: one SQLite file (WAL) with the runs and
// a journal of everything that somebody asked or that happened to them.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/control/run_machine.hpp"
#include "daemon/recorder/sqlite.hpp"

namespace weft::daemon::control {

struct StoredRun {
  std::int64_t number = 0;
  std::filesystem::path recipe, rig, folder;
  std::optional<std::uint64_t> seed;
  std::string name;
  std::string by;
  std::int64_t created_us = 0;  ///< UTC
  RunState state = RunState::queued;
  std::string outcome, cleanup, rig_fact;  ///< the three facts, once it has ended
  std::string error;                       ///< the first thing that went wrong
  std::string dataset_sha256;
  bool resume = false;  ///< somebody asked to go on with what its folder holds

  [[nodiscard]] std::string id() const;  ///< "R-000318"
};

class RunStore {
 public:
  /// Opens or makes the file. Runs that were under way when the daemon died become `interrupted`.
  /// Errors: io, corrupt; wrong_state, when another daemon has it.
  static Result<RunStore> open(const std::filesystem::path& file);

  [[nodiscard]] Result<std::vector<StoredRun>> load();
  /// Gives it its number.
  Status add(StoredRun& run);
  Status update(const StoredRun& run);
  Status journal(std::int64_t utc_us, std::string_view run, std::string_view kind,
                 std::string_view by, std::string_view payload_json = "{}");

  struct Line {
    std::int64_t sequence = 0, utc_us = 0;
    std::string run, kind, by, payload_json;
  };
  /// The newest `most` lines, oldest first; of one run where `run` is not empty.
  [[nodiscard]] Result<std::vector<Line>> tail(std::string_view run, std::size_t most);

 private:
  explicit RunStore(sqlite::Database database) : database_(std::move(database)) {}
  sqlite::Database database_;
};

}  // namespace weft::daemon::control
