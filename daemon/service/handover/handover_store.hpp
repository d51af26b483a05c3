#pragma once
// The state of each run's handover, in the daemon's file.

#include <cstdint>
#include <map>

#include "daemon/storage/certificate/handover_file.hpp"
#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon::handover {

/// Table `hand_over` of weftd.sqlite. Used by the server's thread. Errors: io, also where the file
/// was moved or removed; corrupt.
class HandoverStore {
 public:
  /// `database` outlives the store and has the table (RunStore::open()).
  explicit HandoverStore(sqlite::Database& database) : database_(&database) {}
  /// By the number of their runs.
  [[nodiscard]] Result<std::map<std::int64_t, HandoverStatus>> handovers();
  Status persist(std::int64_t run, const HandoverStatus& fact);

 private:
  sqlite::Database* database_;
};

}  // namespace weft::daemon::handover
