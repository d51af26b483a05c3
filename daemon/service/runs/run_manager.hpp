#pragma once
// The runs of one rig: at most one moves it, on its own thread; the others wait in a queue. Changes
// are written to the daemon's journal before clients are notified.

#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/service/run_model/rig_state.hpp"
#include "daemon/service/runs/maintenance.hpp"
#include "daemon/service/runs/run_executor.hpp"
#include "daemon/service/runs/run_recovery.hpp"

namespace weft::daemon::runs {

/// The request of a run.
struct RunRequest {
  std::filesystem::path recipe;
  std::optional<std::uint64_t> seed;
  std::string name;                       ///< label in its folder's name; may be empty
  std::string by;                         ///< session and user, or a rule
  std::optional<std::size_t> place = {};  ///< in the queue, from 0; default: the end
  std::string digest = {};            ///< of the resolved recipe, "sha256:..."; empty: not checked
  std::filesystem::path folder = {};  ///< its folder, if already chosen
  /// The queue continues even if this run is stopped, aborted or fails after acquiring the rig.
  bool keep_going = false;
  std::string user = {};   ///< the user's lease is kept while it is active
  std::string after = {};  ///< starts once this run has ended complete
  /// Number of runs to queue; a seed increases by one from each to the next.
  std::size_t copies = 1;
  std::string parameters_json = {};  ///< of the recipe; empty: defaults
  /// See CampaignRequest::only_fabric. Such a run has a simulated bench of its own.
  std::optional<std::string> only_fabric = {};
};
constexpr std::size_t most_copies = 100, most_queued = 1000;

/// Changes of a queued run; absent members stay unchanged.
struct QueueEdit {
  std::optional<std::size_t> place = {};  ///< from 0
  std::optional<std::uint64_t> seed = {};
  std::optional<std::string> name = {}, after = {};  ///< `after`: "" removes it
  std::optional<bool> keep_going = {};
};
/// Author of a resume: `by` and `user` as in RunRequest.
struct RecoverRequest {
  std::string by, user = {};
};
/// Author and reason of the removal of a lock-out.
struct UnlockRequest {
  std::string user;
  bool is_allowed_for_others = false;  ///< the role may remove another person's
  std::string reason = {};
};

/// Errors: invalid_argument, if the name is not usable in a folder's name.
Status check_name(const std::string& name);
/// New values; an absent member stays unchanged.
struct Annotation {
  std::optional<std::vector<std::string>> tags = {};
  std::optional<std::string> note = {};
};

/// The request of a run, for the journal.
nlohmann::json submission_of(const StoredRun& run);
/// Request to check for RunManager::submit(). Thread: any; check_quickly() takes a second for a
/// recipe with a million trials.
CampaignRequest request_for(const RunRequest& wanted, const std::filesystem::path& rig);
using Checked = Result<CheckedRequest>;

/// State of the manager.
struct ManagerStatus {
  /// The run that did not obey in time while its thread still runs; only the end of the process
  /// ends it.
  std::optional<std::string> unresponsive;
  /// True when no run is active (or the active one is unresponsive). There is also no motion
  /// outside a run, and no recovery in progress.
  bool is_at_rest = true;
  bool is_closing = false;
  /// The active motion outside a run, such as "retract".
  std::optional<std::string> maintenance = {};
  std::chrono::nanoseconds deadline = std::chrono::nanoseconds::max();  ///< of the active run
  std::uint64_t bytes_awaited = 0;  ///< disk space that the next run waits for; 0 if unknown
};

/// This number of the newest ended runs stays in memory, and the same number of those with an
/// unfinished record.
inline constexpr std::size_t most_ended_loaded = 50;

/// Thread: one, on which `RunContext::post` runs its functions.
class RunManager final : private RunReports {
 public:
  /// `store` must outlive it. If the stored queue has runs, it is paused until a person resumes it.
  RunManager(RunContext context, RunStore& store);
  ~RunManager();  ///< aborts the active run and waits for it

  /// Queues the run, or its copies, and returns the first. It starts when the rig is free, with the
  /// recipe as checked, whatever the file then contains. Errors: those of the check, a digest other
  /// than requested, an unusable name, low disk space; not_found, the run to follow.
  Result<RunView> submit(const RunRequest& wanted, const Checked& checked);
  /// Removes a run that has not started from the queue; a run that was to be resumed returns to its
  /// previous state. Errors: not_found; wrong_state; io, if the change cannot be written: it stays
  /// queued.
  Status remove(std::string_view id, std::string_view by);
  /// `confirms`: with Order::confirm, the name of the confirmed step, as in OperatorPrompt. Errors:
  /// not_found; wrong_state, with the orders that the state accepts; wrong_state, if no prompt or
  /// another one is open.
  Result<RunView> order(std::string_view id, Order order, std::string_view by,
                        std::string_view confirms = {});

  /// Checks whether order() would accept it now. Errors: those of order().
  [[nodiscard]] Status check_order(std::string_view id, Order order,
                                   std::string_view confirms = {}) const;

  /// Reports the effect of a choice for a run that was interrupted, or was stopped, aborted or
  /// failed with trials left; nothing moves. Verifies the campaign on another thread, one second
  /// per 150 MB. The callback is called once, on the manager's thread. Errors: not_found;
  /// wrong_state; those of preview_resume() and preview_keep_partial().
  void preview(std::string_view id, Recovery choice, PreviewCallback on_preview);
  using SettleCallback = std::function<void(const Result<RunView>&)>;
  /// Ends such a run by discarding it or keeping its trials, also on another thread. The rig's
  /// state stays unchanged. Errors: not_found; wrong_state, also for keeping what is already a data
  /// set; those of keep_partial(); io, if the daemon's folder is missing. On an error the run is
  /// unchanged.
  void settle(std::string_view id, Recovery choice, std::string_view by, SettleCallback on_done);
  /// Request to check for recover(). Errors: not_found; wrong_state.
  [[nodiscard]] Result<CampaignRequest> request_to_recover(std::string_view id) const;
  /// Queues such a run to be resumed. Its campaign file is checked when it starts. Errors:
  /// not_found, also if its campaign file is missing; wrong_state; those of the check; io, if the
  /// change cannot be written.
  Result<RunView> recover(std::string_view id, const RecoverRequest& wanted,
                          const Checked& checked);

  /// Sets a person's tags and note of a run; its data stay unchanged. Errors: not_found; io, if the
  /// change cannot be written.
  Result<RunView> annotate(std::string_view id, const Annotation& wanted, std::string_view by);

  [[nodiscard]] const RunQueue& queue() const { return queue_; }
  /// Errors: not_found; wrong_state, also if the run would follow itself; invalid_argument, the
  /// name; io. On an error nothing is changed.
  Status edit(std::string_view id, const QueueEdit& wanted, std::string_view by);
  /// Removes all runs from the queue. Errors: io; then all stay queued.
  Status clear_queue(std::string_view by);
  /// Starts no further run; the active run is not affected. Errors: wrong_state, if it is paused
  /// already.
  Status pause_queue(std::string_view by);
  /// Errors: wrong_state, if it is not paused.
  Status resume_queue(std::string_view by);

  /// Unless the rig can move, no run starts before reset() and unlock(); exception: resuming the
  /// run that left it so.
  [[nodiscard]] const RigState& rig_state() const { return rig_; }
  /// Stops all motion now and latches the rig until reset(). A repeated halt of a latched rig is
  /// only counted in a journal line.
  void halt(RigState::Stop stop, std::string_view by, std::string_view reason = {});
  /// Call when a person has inspected the rig: ends the latch. The fact of a rig that is not safe
  /// stays, but the rig may move again. Errors: wrong_state; invalid_argument, without a reason;
  /// io.
  Status reset(std::string_view reason, std::string_view by);
  /// Blocks all motion until unlock(), over restarts too. Errors: wrong_state, while a run is
  /// active or if another person has locked the rig out; io.
  Status lock_out(const LockOut& lock, std::string_view by);
  /// Errors: those of RigState::unlock(); io.
  Status unlock(const UnlockRequest& wanted, std::string_view by);
  using MaintenanceCallback = std::function<void(const Result<MaintenanceSummary>&)>;
  /// Moves the rig outside a run, on another thread; a halt or the daemon's end stops the motion.
  /// No run starts meanwhile. `on_done` is called once, on the manager's thread, when the motion
  /// has ended. Errors: range; wrong_state, while a run or another motion is active or before a
  /// reset; io, if the motion cannot be journalled; those of run_maintenance(). If the motion could
  /// not start, nothing has moved.
  void maintain(const recipes::MaintenanceOrder& order, std::string_view by,
                MaintenanceCallback on_done);
  /// Injects a fault into the active run's bench, once its devices are open, or ends faults. The
  /// fault is recorded in the run's journal and the daemon's. `on_done` is called once, on the
  /// manager's thread. Errors: wrong_state, without an active run; those of the bench.
  void inject_fault(FaultOrder order, FaultCallback on_done);

  [[nodiscard]] Result<RunView> get(std::string_view id) const;
  /// As RunStore::runs().
  struct Page {
    std::vector<RunView> runs;
    std::optional<std::int64_t> next;
  };
  [[nodiscard]] Result<Page> page(const RunFilter& filter, std::optional<std::int64_t> cursor,
                                  std::size_t limit) const;
  /// The runs in memory, oldest first: all that have not ended, and the newest that have.
  [[nodiscard]] std::vector<RunView> loaded() const;
  [[nodiscard]] std::optional<std::string> active() const;
  [[nodiscard]] ManagerStatus status() const;
  /// Calls back once, when the run has ended; immediately if it already has. Never calls back when
  /// `listener` is gone.
  void when_ended(std::string_view id, std::function<void(const RunView&)> on_ended,
                  std::weak_ptr<const void> listener);
  /// Notifies of a run with facts changed by another part: its handover, or all facts by an import.
  void notify_changed(std::string_view id, std::string_view by);

  /// Call often: handles deadlines, retries postponed writes, and checks the runs' folders for
  /// changes by other programs.
  void tick();
  /// Call when the daemon ends: no further run starts, and the active run retracts the probe. The
  /// run becomes interrupted if trials are left, unless an order had ended it before. Continue to
  /// call tick() until it is at rest. submit(), recover(), settle(), resume_queue() and reset() are
  /// refused from then on with wrong_state.
  void close();

 private:
  struct Run : RunView {
    Deadlines limits{};
    RunForecast forecast = {};
    std::string end_ordered_by;    ///< author of its stop, abort or halt
    std::string pause_ordered_by;  ///< author of a pause that no repetition has taken yet
    bool counted = true;           ///< the number of recorded trials is known
    bool aborted_by_end = false;   ///< aborted because the daemon ended
    bool was_given_up = false;     ///< its thread did not answer in time
    struct Waiting {
      std::function<void(const RunView&)> on_ended;
      std::weak_ptr<const void> listener;
    };
    std::vector<Waiting> waiting = {};
    /// Write time of the certificate in its folder when last read.
    std::optional<std::filesystem::file_time_type> certified_at = {};

    [[nodiscard]] std::int64_t number() const { return stored.number; }
    /// The run in the form to be stored.
    const StoredRun& to_store();
    /// Call when its folder changes: cached contents are read again.
    void forget_folder();
  };

  void on_plan(std::int64_t run, const PlanSummary& plan) override;
  void on_moment(std::int64_t run, const RunStatusUpdate& moment) override;
  void on_vote(std::int64_t run, const LiveVoteUpdate& vote) override;
  void on_progress(std::int64_t run, const TrialProgress& line) override;
  bool grant_rig(std::int64_t run) override;
  void on_thread_ended(std::int64_t run, const RunResult& result) override;

  void load();
  static std::unique_ptr<Run> make_run(const StoredRun& stored);
  Run& insert(std::unique_ptr<Run> run) const;
  /// Removes old ended runs from memory; the store has everything about them.
  void unload_ended();
  [[nodiscard]] Status require_accepting() const;
  /// Checks whether the rig may be moved outside a run. Errors: wrong_state.
  [[nodiscard]] Status require_movable() const;
  /// Ends the active motion outside a run, if any.
  void stop_maintenance(Order order, std::string_view by);
  /// `before`: the rig when the motion was ordered. `has_begun`: something may have moved.
  void on_maintained(const recipes::MaintenanceOrder& order, const RigFacts& before, bool has_begun,
                     std::string_view by, const Result<MaintenanceSummary>& summary);
  [[nodiscard]] Status can_submit(const RunRequest& wanted, const Checked& checked) const;
  [[nodiscard]] StoredRun stored_run(const RunRequest& wanted, const Checked& checked,
                                     std::int64_t number) const;
  [[nodiscard]] std::filesystem::path folder_for(const StoredRun& run) const;
  /// The run as it is after its removal from the queue.
  [[nodiscard]] StoredRun withdrawn(const Run& run) const;
  /// Number of the run that `run` is to follow; 0 for "". Errors: not_found; wrong_state.
  [[nodiscard]] Result<std::int64_t> followed(std::int64_t run, const std::string& after) const;
  /// The run that it is to follow; null without one.
  [[nodiscard]] const Run* run_before(const Run& run) const;
  [[nodiscard]] bool is_ready(std::int64_t run) const;
  [[nodiscard]] Run* numbered(std::int64_t number) const;  ///< in memory
  [[nodiscard]] Result<Run*> find(std::string_view id) const;
  [[nodiscard]] Result<Run*> find_queued(std::string_view id, std::string_view otherwise,
                                         std::string_view hint) const;
  [[nodiscard]] Result<Run*> find_recoverable(std::string_view id) const;
  [[nodiscard]] Result<CampaignRequest> request_of(const StoredRun& run) const;
  [[nodiscard]] JournalLine line(std::string_view run, std::string_view kind,
                                 std::string_view by) const;
  [[nodiscard]] JournalLine line(std::string_view run, std::string_view kind, std::string_view by,
                                 const nlohmann::json& payload) const;
  /// Journals an event that has happened.
  void journal(std::string_view run, std::string_view kind, std::string_view by,
               const nlohmann::json& payload);
  [[nodiscard]] RunView shown(const Run& run) const;
  [[nodiscard]] std::chrono::nanoseconds wall_ahead() const;
  /// As RunView::wall_left_s. The duration of an abort is unknown.
  [[nodiscard]] std::optional<double> left_s(const Run& run) const;
  /// When the prompt opened, or will open.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> prompt_time(
      const Run& run, const OperatorPrompt& prompt) const;
  /// Simulation speed of a simulated bench [bench s / s]; 0: as fast as possible.
  [[nodiscard]] double pace() const;

  /// Changes the run in memory and sends the order to its thread; adds the rows to write to
  /// `change`.
  void stage(Run& run, const RunStep& step, std::string_view by, RunChange& change);
  /// For a person's order: on an error everything stays unchanged. Does not notify.
  Status commit(RunQueue queue, RunChange change);
  /// commit() with one journal line; then notifies of the queue and starts the next run if
  /// possible.
  Status change_queue(RunQueue queue, JournalLine line, std::string_view by);
  Status commit_transition(Run& run, StoredRun stored, const RunStateMachine& machine,
                           std::string_view by);
  /// For events: written now or later, then clients are notified.
  void apply(Run& run, const RunStep& step, std::string_view by, RunChange change = {});
  void notify(Run& run, std::string_view by);
  void notify_queue(std::string_view by);
  void notify_rig(std::string_view by);
  void notify_ended(Run& run);
  [[nodiscard]] Status require_idle() const;
  /// A person's change of the rig. It starts no run: a queue with runs is paused.
  Status change_rig(RigState rig, JournalLine line, std::string_view by);
  void use_plan(Run& run, const PlanSummary& plan);
  /// Starts the next run if the queue, the rig and the disk allow it; otherwise pauses the queue.
  void begin_next();
  void begin(Run& run);
  [[nodiscard]] Status check_storage() const;
  /// Pauses a queue with runs for an automatic cause. `why`: for the journal.
  void pause_queue_for(std::string_view cause, const nlohmann::json& why, RunChange& change);
  /// Applies a person's pause to the queue if the run has no repetition left.
  void carry_pause_over(Run& run, RunChange& change);
  /// Error for an order to an ended run. If the order was to hold or end the run, no further run
  /// starts.
  Error refuse_late(const Run& run, Order order, std::string_view by, Error refused);
  void journal_repeated(const std::vector<RepeatedStops::Counted>& counted);
  /// For a run that did not obey in time; its thread may still end.
  void give_up(Run& run, RunChange& change);
  static bool count_trials(Run& run);
  void on_settled(Run& run, Recovery choice, std::string_view by,
                  const Result<CampaignSummary>& summary, const SettleCallback& on_done);
  /// True if its campaign may be resumed outside the daemon.
  [[nodiscard]] bool can_be_resumed_externally(const Run& run) const;
  void scan_folders();

  const RunContext context_;
  RunStore& store_;
  /// Oldest first; caches the store. find() loads other runs.
  mutable std::vector<std::unique_ptr<Run>> runs_;
  RunQueue queue_;
  RigState rig_;
  RepeatedStops repeated_stops_;
  OperatorPrompts prompts_;
  bool closing_ = false;
  std::chrono::nanoseconds wall_ahead_{};  ///< wall minus monotonic clock, as last published
  RunRecovery recovery_{context_};
  RunExecutor executor_{context_, *this};
  MaintenanceExecutor maintenance_{context_};
  Deadlines::Duration maintenance_deadline_ = Deadlines::Duration::max();  ///< when stopped
};

/// {order, axis, distance_m or distance_rad, from, relative, to, outcome, rig, error}: for clients
/// and the journal.
nlohmann::json maintenance_json(const recipes::MaintenanceOrder& order,
                                const MaintenanceSummary& summary);

}  // namespace weft::daemon::runs
