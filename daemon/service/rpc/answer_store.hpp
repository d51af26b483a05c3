#pragma once
// Answers to requests with an idempotency key, in the daemon's file: they outlive the daemon.

#include <string_view>
#include <vector>

#include "daemon/service/rpc/idempotency.hpp"
#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon::access {

/// Table `answer` of weftd.sqlite. Used by the server's thread. Errors: io, also where the file was
/// moved or removed; corrupt.
class AnswerStore {
 public:
  /// `database` outlives the store and has the table (RunStore::open()).
  explicit AnswerStore(sqlite::Database& database) : database_(&database) {}
  /// Oldest first.
  [[nodiscard]] Result<std::vector<StoredAnswer>> answers();
  Status persist(const StoredAnswer& requested);
  Status persist_outcome(std::string_view name, const rpc::Outcome& outcome);
  Status forget_answer(std::string_view name);

 private:
  sqlite::Database* database_;
};

}  // namespace weft::daemon::access
