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
#include "daemon/service/runs/run_executor.hpp"
#include "daemon/service/runs/run_recovery.hpp"

namespace weft::daemon::runs {

/// What a run is made of.
struct RunRequest {
  std::filesystem::path recipe;
  std::optional<std::uint64_t> seed;
  std::string name;  ///< of its folder; the run's own number where it is empty
  std::string by;
  std::optional<std::size_t> place = {};  ///< in the queue, from 0; the end where it is left out
  std::string digest = {};  ///< of the recipe that is meant, "sha256:..."; empty: as it is
  std::filesystem::path folder = {};  ///< its folder, where that is chosen already
};
/// What to check for RunManager::submit(), on any thread: a recipe that plans a million trials
/// takes check_quickly() a second.
CampaignRequest request_for(const RunRequest& wanted, const std::filesystem::path& rig);
using Checked = Result<CheckedRequest>;

/// Where the daemon is with its runs.
struct ManagerStatus {
  /// The run that did not obey in time, while its thread has not ended: only the process ends it.
  std::optional<std::string> unresponsive;
  /// No run is active but an unresponsive one, and no interrupted run is being settled.
  bool is_at_rest = true;
  bool is_closing = false;
  std::uint64_t bytes_awaited = 0;  ///< by the run that would begin next; 0 where not known
};

/// So many of the newest runs that are over stay in memory, and so many of those of which something
/// is left to be recorded.
inline constexpr std::size_t most_ended_loaded = 50;

/// Used by one thread, which `RunContext::post` calls back to.
class RunManager final : private RunReports {
 public:
  /// `store` outlives it. A queue that is found with runs in it is paused: a person resumes it, or
  /// resets the rig.
  RunManager(RunContext context, RunStore& store);
  ~RunManager();  ///< aborts what runs and waits for it

  /// Puts the run into the queue; it begins when the rig is free, with the recipe as it was
  /// checked, whatever its file says by then. Errors: those of the check, another digest than the
  /// request's, an unusable name, not enough disk.
  Result<RunView> submit(const RunRequest& wanted, const Checked& checked);
  /// Takes a run that has not begun out of the queue; one that was to be resumed is as it was
  /// before. Errors: not_found; wrong_state; io, where that cannot be written: it waits as before.
  Status remove(std::string_view id, std::string_view by);
  /// `confirms`: with Order::confirm, the name of what a person has done, as OperatorPrompt has it.
  /// Errors: not_found; wrong_state, with what the state takes; wrong_state, when nothing is asked,
  /// or something else.
  Result<RunView> order(std::string_view id, Order order, std::string_view by,
                        std::string_view confirms = {});

  /// What a choice would do with an interrupted run; nothing moves. The campaign is verified, which
  /// takes a second for each 150 MB, on another thread; the callback is called once, on the
  /// manager's. Errors: not_found; wrong_state; preview_resume()'s, preview_keep_partial()'s.
  void preview(std::string_view id, Recovery choice, PreviewCallback on_preview);
  using SettleCallback = std::function<void(const Result<RunView>&)>;
  /// Ends an interrupted run by discarding it or keeping what there is, on another thread as well.
  /// The state of the rig remains as it is. Errors: not_found; wrong_state; keep_partial()'s; io,
  /// where the daemon's folder is away. The run is interrupted as before then.
  void settle(std::string_view id, Recovery choice, std::string_view by, SettleCallback on_done);
  /// What to check for recover(). Errors: not_found; wrong_state.
  [[nodiscard]] Result<CampaignRequest> request_to_recover(std::string_view id) const;
  /// Puts an interrupted run into the queue again, to be resumed where it was. Its file is
  /// checked when it begins. Errors: not_found, also where its campaign is not there any more;
  /// wrong_state; those of the check; io, where that cannot be written.
  Result<RunView> recover(std::string_view id, std::string_view by, const Checked& checked);

  [[nodiscard]] const RunQueue& queue() const { return queue_; }
  /// Another place in the queue, from 0. Errors: not_found, wrong_state.
  Status move(std::string_view id, std::size_t place, std::string_view by);
  /// Nothing more begins; the run under way is not affected. Errors: wrong_state, when it is
  /// paused.
  Status pause_queue(std::string_view by);
  /// Errors: wrong_state, when it is not paused.
  Status resume_queue(std::string_view by);

  /// Where it is not safe nothing begins before reset(), but for the run that left it unknown, once
  /// a person resumes that.
  [[nodiscard]] const RigState& rig_state() const { return rig_; }
  /// Stops motion now, whatever runs, and latches the rig until reset(). The same order again, of a
  /// rig that is latched, is counted in a line of the journal.
  void halt(RigState::Stop stop, std::string_view by, std::string_view reason = {});
  /// Errors: wrong_state; invalid_argument, without a reason; io.
  Status reset(std::string_view reason, std::string_view by);
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
    bool counted = true;          ///< how many trials are on record is known
    bool aborted_by_end = false;  ///< the daemon's end gave the order
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
  [[nodiscard]] Status can_submit(const RunRequest& wanted, const Checked& checked) const;
  [[nodiscard]] Run* numbered(std::int64_t number) const;  ///< in memory
  [[nodiscard]] Result<Run*> find(std::string_view id) const;
  [[nodiscard]] Result<Run*> find_queued(std::string_view id, std::string_view otherwise,
                                         std::string_view hint) const;
  [[nodiscard]] Result<Run*> find_interrupted(std::string_view id) const;
  [[nodiscard]] Result<CampaignRequest> request_of(const StoredRun& run) const;
  [[nodiscard]] JournalLine line(std::string_view run, std::string_view kind,
                                 std::string_view by) const;
  [[nodiscard]] JournalLine line(std::string_view run, std::string_view kind, std::string_view by,
                                 const nlohmann::json& payload) const;
  [[nodiscard]] JournalLine state_line(const StoredRun& run, std::string_view by) const;
  /// Of what has happened.
  void journal(std::string_view run, std::string_view kind, std::string_view by,
               const nlohmann::json& payload);
  [[nodiscard]] RunView shown(const Run& run) const;
  [[nodiscard]] std::chrono::nanoseconds wall_ahead() const;

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
  void use_plan(Run& run, const PlanSummary& plan);
  void begin_next();
  void begin(Run& run);
  bool pause_after(const Run& run, const Error& why, RunChange& change);
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
  bool disk_is_awaited_ = false;           ///< its folder or its space, without which no run begins
  std::chrono::nanoseconds wall_ahead_{};  ///< of the monotonic clock, when times were sent last
  RunRecovery recovery_{context_};
  RunExecutor executor_{context_, *this};
};

}  // namespace weft::daemon::runs
