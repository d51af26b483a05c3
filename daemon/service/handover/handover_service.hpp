#pragma once
// Handovers of weftd's runs: one at a time, on a low-priority thread, in the order in which their
// runs ended. One that was interrupted by the daemon's death is repeated at the next start, at most
// twice.

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "daemon/analysis/handover/handover.hpp"
#include "daemon/service/run_store/run_store.hpp"
#include "daemon/storage/certificate/handover_file.hpp"
#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon::handover {

/// State of each run's handover: table `hand_over` of weftd.sqlite. Thread: the server's. Errors:
/// io, also if the file was moved or removed; corrupt.
class HandoverStore {
 public:
  /// `database` must outlive the store and have the table (RunStore::open()).
  explicit HandoverStore(sqlite::Database& database) : database_(&database) {}
  /// Empty if there is no row.
  [[nodiscard]] Result<std::optional<HandoverStatus>> find(std::int64_t run);
  /// Complete runs without a row or with an unfinished handover, oldest first.
  [[nodiscard]] Result<std::vector<std::int64_t>> unfinished();
  Status persist(std::int64_t run, const HandoverStatus& fact);

 private:
  sqlite::Database* database_;
};

struct HandoverContext {
  std::function<void(std::function<void()>)> post;  ///< to the service's thread, from any
  std::function<std::int64_t()> utc_us;
  std::function<void(std::string_view run, const HandoverStatus&)> on_changed;
};

/// Thread: one, on which `post` runs its functions.
class HandoverService {
 public:
  /// `journal` must outlive the service, which keeps its own rows in the same file.
  HandoverService(HandoverContext context, runs::RunStore& journal);
  ~HandoverService();  ///< stops the active handover and waits for it
  HandoverService(const HandoverService&) = delete;
  HandoverService& operator=(const HandoverService&) = delete;

  /// Considers the runs with handovers that the previous daemon left unfinished.
  void resume();
  /// Call when a run has changed. When the run first ends with all of its trials
  /// (StoredRun::has_all), its recipe decides about a handover. `wanted` is that decision; if
  /// unknown, it is read from the record in the run's folder.
  void consider(const runs::StoredRun& run, std::optional<bool> wanted);
  /// Repeats a handover that failed or was cancelled, or that has damaged files. Errors: not_found,
  /// the run has no handover; wrong_state, it is under way.
  Status again(std::string_view run, std::string_view by);
  /// Errors: not_found; wrong_state, it has ended.
  Status cancel(std::string_view run, std::string_view by);
  /// Call when the daemon ends: stops the active handover, which the next start repeats. Does not
  /// wait for it, because a disk may hang.
  void put_off();
  /// Empty if there is none.
  [[nodiscard]] std::optional<HandoverStatus> get(std::string_view run) const;
  /// Calls back when the handover has ended; immediately if it already has, or if there is none.
  /// Never calls back when `listener` is gone.
  void when_over(std::string_view run, std::function<void()> on_over,
                 std::weak_ptr<const void> listener);

 private:
  struct Item {
    runs::StoredRun run;
    HandoverStatus fact;
    struct Waiting {
      std::function<void()> on_over;
      std::weak_ptr<const void> listener;
    };
    std::vector<Waiting> waiting = {};
  };
  static HandoverStatus initial_status(const runs::StoredRun& run, std::optional<bool> wanted);
  /// From memory, or else from the database. Empty if the run has none.
  [[nodiscard]] std::optional<HandoverStatus> load(std::string_view run) const;
  void give_up(Item& item);
  void enqueue(Item& item, std::string_view by);
  void begin_next();
  void progressed(const std::string& id, const EvaluationProgress& progress);
  void ended(const std::string& id, const Result<HandoverResult>& result);
  void enter(Item& item, HandoverStatus fact);
  [[nodiscard]] Item* find(std::string_view run);

  HandoverContext context_;
  runs::RunStore& journal_;
  mutable HandoverStore store_;
  /// Unfinished handovers, and those with an end that could not be written.
  std::map<std::string, Item, std::less<>> items_;
  std::deque<std::string> queue_;
  std::string active_, cancelled_by_;
  std::jthread thread_;
};

}  // namespace weft::daemon::handover
