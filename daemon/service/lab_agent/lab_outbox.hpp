#pragma once
// The publications that a daemon still owes the laboratory's store, in its own weftd.sqlite: they
// survive a restart and a store that cannot be reached.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/service/lab/lab_store.hpp"
#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon::lab {

/// A run that the store does not know in its newest state.
struct UnpublishedRun {
  std::int64_t run = 0;
  std::int64_t revision_us = 0;                 ///< UTC of the change
  std::optional<std::int64_t> changed_us = {};  ///< the same; empty: before the laboratory's time
};

/// The part that this rig holds.
struct HeldPart {
  PartLease lease;
  std::string campaign_name = {}, fabric = {};
  std::int64_t attempt = 0;
  std::int64_t run = 0;  ///< 0: not started
};

/// Thread: the server's. Errors: io.
class LabOutbox {
 public:
  /// `database` must outlive it; makes the missing tables.
  static Result<LabOutbox> open(sqlite::Database& database);

  /// Random identity of this memory, made once.
  Result<std::string> instance();
  /// Call when connected: with another store than before, all runs are to be published again.
  /// Returns whether that is so.
  Result<bool> use_store(const std::string& store);
  /// To be published, if `state` is not the one of the last call. `is_over`: a run that is over
  /// when it is seen first has ended at an unknown time.
  Status mark(std::int64_t run, std::string_view state, bool is_over, std::int64_t utc_us);
  /// The oldest change first.
  Result<std::vector<UnpublishedRun>> pending(std::size_t most);
  Result<std::int64_t> count();
  Result<bool> has(std::int64_t run);
  /// A run that has changed again meanwhile stays.
  Status on_published(const UnpublishedRun& published);

  Result<std::optional<HeldPart>> part();
  Status set_part(const std::optional<HeldPart>& part);

 private:
  explicit LabOutbox(sqlite::Database& database) : database_(&database) {}
  sqlite::Database* database_;
};

}  // namespace weft::daemon::lab
