#pragma once
// The runs of one rig: at most one at a time moves it, on a thread of its own; the others wait in a
// queue. What happens is written to the daemon's journal before clients are notified.

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

/// What a run is made of.
struct RunRequest {
  std::filesystem::path recipe;
  std::optional<std::uint64_t> seed;
  std::string name;                       ///< of its folder; the run's own number where it is empty
  std::string by;                         ///< session and user, or a rule
  std::optional<std::size_t> place = {};  ///< in the queue, from 0; the end where it is left out
  std::string digest = {};                ///< of the resolved recipe, "sha256:..."; empty: as it is
  std::filesystem::path folder = {};      ///< its folder, where that is chosen already
  /// The queue goes on after this run also where it is stopped, aborted or fails with the rig.
  bool keep_going = false;
  std::string user = {};   ///< whose lease is kept while it is under way
  std::string after = {};  ///< it begins once this run has ended complete
  /// As many runs, with numbers of their own; a seed counts up from one to the next.
  std::size_t copies = 1;
  std::string parameters_json = {};  ///< of the recipe; empty: their defaults
};
constexpr std::size_t most_copies = 100, most_queued = 1000;

/// What a person changes of a run that waits; what is left out stays.
struct QueueEdit {
  std::optional<std::size_t> place = {};  ///< from 0
  std::optional<std::uint64_t> seed = {};
  std::optional<std::string> name = {}, after = {};  ///< after: "" ends it
  std::optional<bool> keep_going = {};
};
/// Who resumes a run that is over: `by` as in RunRequest.
struct RecoverRequest {
  std::string by, user = {};
};
/// Who removes a lock-out, and why.
struct UnlockRequest {
  std::string user;
  bool is_allowed_for_others = false;  ///< the role may remove another person's
  std::string reason = {};
};

/// Errors: invalid_argument, for a name that is no plain part of a folder's name.
Status check_name(const std::string& name);
/// What changes; the other stays.
struct Annotation {
  std::optional<std::vector<std::string>> tags = {};
  std::optional<std::string> note = {};
};

/// What a person asked for, for the journal.
nlohmann::json submission_of(const StoredRun& run);
/// What to check for RunManager::submit(), on any thread: a recipe that plans a million trials
/// takes check_quickly() a second.
CampaignRequest request_for(const RunRequest& wanted, const std::filesystem::path& rig);
using Checked = Result<CheckedRequest>;

/// Where the daemon is with its runs.
struct ManagerStatus {
  /// The run that did not obey in time, while its thread has not ended: only the process ends it.
  std::optional<std::string> unresponsive;
  /// No run is active but an unresponsive one, no motion outside a run is under way, and no
  /// interrupted run is being settled.
  bool is_at_rest = true;
  bool is_closing = false;
  /// The motion outside a run that is under way, "retract".
  std::optional<std::string> maintenance = {};
  std::chrono::nanoseconds deadline = std::chrono::nanoseconds::max();  ///< of the run under way
  std::uint64_t bytes_awaited = 0;  ///< by the run that would begin next; 0 where not known
};

/// So many of the newest runs that are over stay in memory, and so many of those of which something
/// is left to be recorded.
inline constexpr std::size_t most_ended_loaded = 50;

/// Used by one thread, which `RunContext::post` calls back to.
class RunManager final : private RunReports {
 public:
  /// `store` outlives it. A queue that is found with runs in it is paused: a person resumes it.
  RunManager(RunContext context, RunStore& store);
  ~RunManager();  ///< aborts what runs and waits for it

  /// Puts the run, or its copies, into the queue; it begins when the rig is free, with the recipe
  /// as it was checked, whatever its file says by then. The first of the copies. Errors: those of
  /// the check, another digest than the request's, an unusable name, not enough disk; not_found,
  /// the run to follow.
  Result<RunView> submit(const RunRequest& wanted, const Checked& checked);
  /// Takes a run that has not begun out of the queue; one that was to be resumed is as it was
  /// before. Errors: not_found; wrong_state; io, where that cannot be written: it waits as before.
  Status remove(std::string_view id, std::string_view by);
  /// `confirms`: with Order::confirm, the name of what a person has done, as OperatorPrompt has it.
  /// Errors: not_found; wrong_state, with what the state takes; wrong_state, when nothing is asked,
  /// or something else.
  Result<RunView> order(std::string_view id, Order order, std::string_view by,
                        std::string_view confirms = {});

  /// Whether order() would take it now. Errors: order()'s.
  [[nodiscard]] Status check_order(std::string_view id, Order order,
                                   std::string_view confirms = {}) const;

  /// What a choice would do with a run that was interrupted, or was stopped, aborted or failed with
  /// trials left; nothing moves. The campaign is verified, which
  /// takes a second for each 150 MB, on another thread; the callback is called once, on the
  /// manager's. Errors: not_found; wrong_state; preview_resume()'s, preview_keep_partial()'s.
  void preview(std::string_view id, Recovery choice, PreviewCallback on_preview);
  using SettleCallback = std::function<void(const Result<RunView>&)>;
  /// Ends such a run by discarding it or keeping what there is, on another thread as well. The
  /// state of the rig remains as it is. Errors: not_found; wrong_state, also to keep what is a data
  /// set already; keep_partial()'s; io, where the daemon's folder is away. The run is as before
  /// then.
  void settle(std::string_view id, Recovery choice, std::string_view by, SettleCallback on_done);
  /// What to check for recover(). Errors: not_found; wrong_state.
  [[nodiscard]] Result<CampaignRequest> request_to_recover(std::string_view id) const;
  /// Puts such a run into the queue again, to be resumed where it was. Its file is
  /// checked when it begins. Errors: not_found, also where its campaign is not there any more;
  /// wrong_state; those of the check; io, where that cannot be written.
  Result<RunView> recover(std::string_view id, const RecoverRequest& wanted,
                          const Checked& checked);

  /// What a person says of a run; its data stay as they are. Errors: not_found; io, where that
  /// cannot be written.
  Result<RunView> annotate(std::string_view id, const Annotation& wanted, std::string_view by);

  [[nodiscard]] const RunQueue& queue() const { return queue_; }
  /// Errors: not_found; wrong_state, also where the run would follow itself; invalid_argument,
  /// a name; io. Nothing is changed then.
  Status edit(std::string_view id, const QueueEdit& wanted, std::string_view by);
  /// Takes all runs that wait out of the queue. Errors: io; all wait as before then.
  Status clear_queue(std::string_view by);
  /// Nothing more begins; the run under way is not affected. Errors: wrong_state, when it is
  /// paused.
  Status pause_queue(std::string_view by);
  /// Errors: wrong_state, when it is not paused.
  Status resume_queue(std::string_view by);

  /// Unless the rig can move, nothing begins before reset() and unlock(); exception: resuming the
  /// run that left it so.
  [[nodiscard]] const RigState& rig_state() const { return rig_; }
  /// Stops motion now, whatever runs, and latches the rig until reset(). The same order again, of a
  /// rig that is latched, is counted in a line of the journal.
  void halt(RigState::Stop stop, std::string_view by, std::string_view reason = {});
  /// A person has looked at the rig: ends the latch. The fact of a rig that is not safe remains,
  /// and the rig may move again. Errors: wrong_state; invalid_argument, without a reason; io.
  Status reset(std::string_view reason, std::string_view by);
  /// Nothing moves before unlock(), over restarts too. Errors: wrong_state, while a run is under
  /// way or where another person has locked it out; io.
  Status lock_out(const LockOut& lock, std::string_view by);
  /// Errors: RigState::unlock()'s; io.
  Status unlock(const UnlockRequest& wanted, std::string_view by);
  using MaintenanceCallback = std::function<void(const Result<MaintenanceSummary>&)>;
  /// Moves the rig outside a run, on another thread; a halt or the daemon's end stops the motion.
  /// Nothing else begins meanwhile. Called back once, on the manager's thread, when the motion has
  /// ended. Errors: range; wrong_state, while a run or another motion is under way or before a
  /// reset; io, where the motion cannot be journalled; run_maintenance()'s. Nothing has moved then.
  void maintain(const recipes::MaintenanceOrder& order, std::string_view by,
                MaintenanceCallback on_done);
  /// Injects a fault into the bench of the run under way, once its devices are up, or ends some; it
  /// is in the run's journal and the daemon's. The callback is called once, on the manager's
  /// thread. Errors: wrong_state, without a run; those of the bench.
  void inject_fault(FaultOrder order, FaultCallback on_done);

  [[nodiscard]] Result<RunView> get(std::string_view id) const;
  /// As RunStore::runs().
  struct Page {
    std::vector<RunView> runs;
    std::optional<std::int64_t> next;
  };
  [[nodiscard]] Result<Page> page(const RunFilter& filter, std::optional<std::int64_t> cursor,
                                  std::size_t limit) const;
  /// The runs in memory, the oldest first: all that are not over, and the newest that are.
  [[nodiscard]] std::vector<RunView> loaded() const;
  [[nodiscard]] std::optional<std::string> active() const;
  [[nodiscard]] ManagerStatus status() const;
  /// Calls back once, when the run has ended; at once where it has; never, once `listener` is gone.
  void when_ended(std::string_view id, std::function<void(const RunView&)> on_ended,
                  std::weak_ptr<const void> listener);
  /// Notifies of a run whose facts others have changed: its handover, or all by an import.
  void notify_changed(std::string_view id, std::string_view by);

  /// Call often: deadlines, what could not be written, and what others did in the folders of runs.
  void tick();
  /// The daemon ends: nothing more begins, and the run under way retracts the probe. It is
  /// interrupted then where anything of it is left, unless an order had ended it before. Tick
  /// on until it is at rest. submit(), recover(), settle(), resume_queue() and reset() are refused
  /// from then on, as wrong_state.
  void close();

 private:
  struct Run : RunView {
    Deadlines limits{};
    RunForecast forecast = {};
    std::string end_ordered_by;    ///< who stopped, aborted or halted it, or which rule
    std::string pause_ordered_by;  ///< the person whose pause no repetition has taken yet
    bool counted = true;           ///< how many trials are on record is known
    bool aborted_by_end = false;   ///< the daemon's end gave the order
    bool was_given_up = false;     ///< its thread did not answer in time
    struct Waiting {
      std::function<void(const RunView&)> on_ended;
      std::weak_ptr<const void> listener;
    };
    std::vector<Waiting> waiting = {};
    /// Of the certificate in its folder, as it was read last.
    std::optional<std::filesystem::file_time_type> certified_at = {};

    [[nodiscard]] std::int64_t number() const { return stored.number; }
    /// As it is to be written.
    const StoredRun& to_store();
    /// Its folder becomes another one: what was read of it is read again.
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
  /// Of a run that is over and not among the newest, the store has everything.
  void unload_ended();
  [[nodiscard]] Status require_accepting() const;
  /// Whether the rig may be moved outside a run. Errors: wrong_state.
  [[nodiscard]] Status require_movable() const;
  /// Ends the motion outside a run, if one is under way.
  void stop_maintenance(Order order, std::string_view by);
  /// `before`: the rig as it was when the motion was ordered.
  /// `has_begun`: something may have moved.
  void on_maintained(const recipes::MaintenanceOrder& order, const RigFacts& before, bool has_begun,
                     std::string_view by, const Result<MaintenanceSummary>& summary);
  [[nodiscard]] Status can_submit(const RunRequest& wanted, const Checked& checked) const;
  [[nodiscard]] StoredRun stored_run(const RunRequest& wanted, const Checked& checked,
                                     std::int64_t number) const;
  [[nodiscard]] std::filesystem::path folder_for(const StoredRun& run) const;
  /// As it is once a person has taken it out of the queue.
  [[nodiscard]] StoredRun withdrawn(const Run& run) const;
  /// The number of the run that `run` is to follow; 0 for "". Errors: not_found; wrong_state.
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
  /// Of what has happened.
  void journal(std::string_view run, std::string_view kind, std::string_view by,
               const nlohmann::json& payload);
  [[nodiscard]] RunView shown(const Run& run) const;
  [[nodiscard]] std::chrono::nanoseconds wall_ahead() const;
  /// As RunView::wall_left_s. Nobody knows how long an abort takes.
  [[nodiscard]] std::optional<double> left_s(const Run& run) const;
  /// Since when it is asked, or when it will be.
  [[nodiscard]] std::optional<std::chrono::nanoseconds> prompt_time(
      const Run& run, const OperatorPrompt& prompt) const;
  /// Of a simulated bench [bench s / s]; 0: as fast as it can.
  [[nodiscard]] double pace() const;

  /// In memory, with the order to its thread; what is to be written is added to `change`.
  void stage(Run& run, const RunStep& step, std::string_view by, RunChange& change);
  /// A person's order: everything is as before where it cannot be written. Notifies nobody.
  Status commit(RunQueue queue, RunChange change);
  /// commit() with one line of the journal; then notifies of the queue and begins what may begin.
  Status change_queue(RunQueue queue, JournalLine line, std::string_view by);
  Status commit_transition(Run& run, StoredRun stored, const RunStateMachine& machine,
                           std::string_view by);
  /// What has happened: written now or later, then clients are notified.
  void apply(Run& run, const RunStep& step, std::string_view by, RunChange change = {});
  void notify(Run& run, std::string_view by);
  void notify_queue(std::string_view by);
  void notify_rig(std::string_view by);
  void notify_ended(Run& run);
  [[nodiscard]] Status require_idle() const;
  /// A person's change of the rig. Nothing begins by it: a queue in which runs wait is paused.
  Status change_rig(RigState rig, JournalLine line, std::string_view by);
  void use_plan(Run& run, const PlanSummary& plan);
  /// Begins the next run if the queue, the rig and the disk allow it; else pauses the queue.
  void begin_next();
  void begin(Run& run);
  [[nodiscard]] Status check_storage() const;
  /// Pauses a queue in which runs wait, for an automatic cause. `why`: for the journal.
  void pause_queue_for(std::string_view cause, const nlohmann::json& why, RunChange& change);
  /// A person's pause that no repetition of the run is left to take.
  void carry_pause_over(Run& run, RunChange& change);
  /// The refusal of an order to a run that is over. Nothing more begins where the order was to
  /// hold or end it.
  Error refuse_late(const Run& run, Order order, std::string_view by, Error refused);
  void journal_repeated(const std::vector<RepeatedStops::Counted>& counted);
  /// It did not obey in time: its thread may come to an end yet.
  void give_up(Run& run, RunChange& change);
  static bool count_trials(Run& run);
  void on_settled(Run& run, Recovery choice, std::string_view by,
                  const Result<CampaignSummary>& summary, const SettleCallback& on_done);
  /// Whether its campaign may be resumed without the daemon.
  [[nodiscard]] bool can_be_resumed_externally(const Run& run) const;
  void scan_folders();

  const RunContext context_;
  RunStore& store_;
  /// Oldest first; caches the store. A run that is used is loaded by find().
  mutable std::vector<std::unique_ptr<Run>> runs_;
  RunQueue queue_;
  RigState rig_;
  RepeatedStops repeated_stops_;
  OperatorPrompts prompts_;
  bool closing_ = false;
  std::chrono::nanoseconds wall_ahead_{};  ///< of the monotonic clock, when times were sent last
  RunRecovery recovery_{context_};
  RunExecutor executor_{context_, *this};
  MaintenanceExecutor maintenance_{context_};
  Deadlines::Duration maintenance_deadline_ = Deadlines::Duration::max();  ///< of a stop of it
};

/// {order, axis, distance_m or distance_rad, from, relative, to, outcome, rig, error}: for clients
/// and the journal.
nlohmann::json maintenance_json(const recipes::MaintenanceOrder& order,
                                const MaintenanceSummary& summary);

}  // namespace weft::daemon::runs
