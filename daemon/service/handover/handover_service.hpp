#pragma once
// The hand-overs of weftd's runs: one at a time, on a thread of low priority, in the order in which
// their runs ended. One that the daemon's death cut is done again at its next start, twice at most.

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

/// The state of each run's handover: table `hand_over` of weftd.sqlite. Used by the server's
/// thread. Errors: io, also where the file was moved or removed; corrupt.
class HandoverStore {
 public:
  /// `database` outlives the store and has the table (RunStore::open()).
  explicit HandoverStore(sqlite::Database& database) : database_(&database) {}
  /// Nothing where there is no row.
  [[nodiscard]] Result<std::optional<HandoverStatus>> find(std::int64_t run);
  /// Complete runs, the oldest first, without a row or with one of a handover that is not over.
  [[nodiscard]] Result<std::vector<std::int64_t>> unfinished();
  Status persist(std::int64_t run, const HandoverStatus& fact);

 private:
  sqlite::Database* database_;
};

struct HandoverContext {
  std::function<void(std::function<void()>)> post;  ///< onto the service's thread, from any
  std::function<std::int64_t()> utc_us;
  std::function<void(std::string_view run, const HandoverStatus&)> on_changed;
};

/// Used by one thread, which `post` calls back to.
class HandoverService {
 public:
  /// `journal` outlives the service, which keeps its own rows in the same file.
  HandoverService(HandoverContext context, runs::RunStore& journal);
  ~HandoverService();  ///< gives up what runs and waits for it
  HandoverService(const HandoverService&) = delete;
  HandoverService& operator=(const HandoverService&) = delete;

  /// Considers the runs whose handovers the daemon before this one left unfinished.
  void resume();
  /// A run has changed. The first time that it has ended with all of its trials
  /// (StoredRun::has_all) its recipe says whether it is handed over: `wanted`, or, where that is
  /// not known, as it is on record in the run's folder, which is read then.
  void consider(const runs::StoredRun& run, std::optional<bool> wanted);
  /// Once more, where it failed, was cancelled, or its files were damaged since.
  /// Errors: not_found, no hand-over of that run; wrong_state, it is under way.
  Status again(std::string_view run, std::string_view by);
  /// Errors: not_found; wrong_state, it is over.
  Status cancel(std::string_view run, std::string_view by);
  /// The daemon ends: what runs is stopped, and is done at the next start. Nothing waits for it: a
  /// disk may hang.
  void put_off();
  /// Nothing where there is none.
  [[nodiscard]] std::optional<HandoverStatus> get(std::string_view run) const;
  /// Calls back once it is over; at once where it is, or there is none; never, once `listener` is
  /// gone.
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
  /// In memory, or as it is on record. Nothing where the run has none.
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
  /// Those that are not over, or whose end could not be written.
  std::map<std::string, Item, std::less<>> items_;
  std::deque<std::string> queue_;
  std::string active_, cancelled_by_;
  std::jthread thread_;
};

}  // namespace weft::daemon::handover
