#pragma once
// The runs of one rig: at most one at a time moves it, on a thread of its own; the others wait in a
// queue. What happens is kept in the daemon's journal before it is told.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "daemon/campaign/bench_check.hpp"
#include "daemon/campaign/campaign.hpp"
#include "daemon/campaign/resume.hpp"
#include "daemon/service/runs/repeated_stops.hpp"
#include "daemon/service/runs/run_machine.hpp"
#include "daemon/service/runs/run_store.hpp"
#include "daemon/storage/certificate/hand_over_fact.hpp"

namespace weft::daemon::control {

/// What a run is made of.
struct RunWish {
  std::filesystem::path recipe;
  std::optional<std::uint64_t> seed;
  std::string name;  ///< of its folder; the run's own number where it is empty
  std::string by;
  std::optional<std::size_t> place = {};  ///< in line, from 0; the end where it is left out
  std::string digest = {};  ///< of the recipe that is meant, "sha256:..."; empty: as it is
  std::filesystem::path folder = {};  ///< its folder, where that is chosen already
};

/// What a person is asked for, or will be.
struct Attention {
  recipes::OperatorAsk ask;
  std::string step;  ///< names what is asked now, "Q-12"; empty where it is not asked yet
  /// Since when, or when it will be as far as is known, by the desk's monotonic clock.
  std::optional<std::chrono::nanoseconds> at = {};
  /// The same as the machine's wall clock has it when the run is told: UTC.
  std::optional<std::int64_t> at_us = {};
};

/// What the folder of a run that is over holds by now, where its campaign was gone on with since,
/// and not by the daemon: `weft run --resume` was.
struct CampaignSince {
  std::size_t trials_done = 0, trials_planned = 0;
  bool complete = false;  ///< it came to its end with all of them
  std::string dataset_sha256;
  friend bool operator==(const CampaignSince&, const CampaignSince&) = default;
};

/// A run and where it is.
struct RunView {
  StoredRun stored;
  RunMachine machine;
  std::optional<RunMoment> moment;
  std::optional<VoteMoment> vote;      ///< the newest of its recipe's live votes
  std::optional<Attention> attention;  ///< the next human action
  std::size_t trials_done = 0;
  std::size_t trials_planned = 0;
  std::size_t takes_rejected = 0;         ///< bad ones that were taken again
  std::string last_rejection;             ///< why the newest of them was
  double wall_left_s = 0;                 ///< by the mean of the trials done, and people's time
  std::string changed_by;                 ///< whose word or act made it what it is told as now
  std::optional<HandOverFact> hand_over;  ///< where its recipe has one and it is complete
  /// Whether its recipe has one, once the run has ended in this life of the daemon.
  std::optional<bool> wants_hand_over = {};
  std::optional<CampaignSince> since = {};
};

/// What becomes of an interrupted run.
enum class Recovery {
  resume,       ///< it goes on where it was
  discard,      ///< it has ended, and no data set is made of it
  keep_partial  ///< it has ended, and its data set is of the trials that are complete
};
std::string_view to_string(Recovery choice);

using FaultTold = std::function<void(const Status&)>;

/// Used by one thread, which `post` calls back to.
class RunDesk {
 public:
  using Clock = RunMachine::Clock;
  struct Surroundings {
    std::filesystem::path rig;                        ///< rig file
    std::filesystem::path data;                       ///< one folder for each run
    std::function<void(std::function<void()>)> post;  ///< onto the desk's thread, from any
    std::function<Clock()> now;
    std::function<std::int64_t()> utc_us;
    std::function<void(const RunView&)> changed;
    /// The rig stands otherwise than before, by whose word or act.
    std::function<void(const RigStanding&, std::string_view by)> stands;
    std::function<void(const RunView&)> voted = {};  ///< there is a new live vote
    /// The line is another one, by whose word or act.
    std::function<void(const RunLine&, std::string_view by)> lined = {};
    Onlooker* onlooker = nullptr;     ///< shown what the run under way senses
    const BenchPace* pace = nullptr;  ///< of a simulated bench
    /// The machine's wall clock, which people compare times ahead with; it may be set back.
    std::function<std::int64_t()> wall_us = {};
    /// What a run is, on its thread.
    std::function<Result<CampaignSummary>(const CampaignRequest&, const CampaignHooks&)> perform =
        run_campaign;
    /// Whether a folder has room for so many bytes.
    std::function<Status(const std::filesystem::path&, std::uint64_t)> room = check_space;
    /// Whether a rig file can be run, as far as that is known without a recipe.
    std::function<Status(const std::filesystem::path&)> rig_holds = check_rig_file;
    /// Of the daemon inside `weft run`: after the first submit() every other is refused, the run
    /// has no deadline but those that follow an order, and ends for good.
    bool one_run = false;
  };
  /// `store` outlives the desk.
  RunDesk(Surroundings around, RunStore& store);
  ~RunDesk();  ///< aborts what runs and waits for it
  RunDesk(const RunDesk&) = delete;
  RunDesk& operator=(const RunDesk&) = delete;

  /// check_quickly() of a recipe that plans a million trials takes a second, on any thread.
  using Checked = Result<CheckedRequest>;
  /// What to check for submit().
  [[nodiscard]] CampaignRequest request_for(const RunWish& wish) const;
  /// Puts the run in line; it begins when the rig is free, with the recipe as it was checked,
  /// whatever its file says by then. Errors: those of the check, another digest than the wish's, an
  /// unusable name, not enough disk.
  Result<RunView> submit(const RunWish& wish, const Checked& checked);
  /// Both.
  Result<RunView> submit(const RunWish& wish) {
    return submit(wish, check_quickly(request_for(wish)));
  }
  /// Takes a run that has not begun out of the line; one that was to go on is as it was before.
  /// Errors: not_found; wrong_state; io, where that cannot be written down, and it waits as before.
  Status withdraw(std::string_view id, std::string_view by);
  /// Errors: not_found; wrong_state, with what the state takes.
  Result<RunView> order(std::string_view id, Order order, std::string_view by);
  /// A person has done what the run waits for. `step`: its name, as Attention has it.
  /// Errors: not_found; wrong_state, when nothing is asked, or something else.
  Result<RunView> confirm(std::string_view id, std::string_view step, std::string_view by);
  using PreviewTold = std::function<void(const Result<ResumePreview>&)>;
  /// What a choice would do with an interrupted run; nothing moves. The campaign is verified, which
  /// takes a second for each 150 MB, on another thread; `told` is called once, on the desk's.
  /// Errors: not_found; wrong_state; preview_resume()'s, preview_keep_partial()'s.
  void preview(std::string_view id, Recovery choice, PreviewTold told);
  using SettledTold = std::function<void(const Result<RunView>&)>;
  /// Ends an interrupted run by discarding it or keeping what there is, on another thread likewise.
  /// How the rig stands remains as it is. Errors: not_found; wrong_state; keep_partial()'s; io,
  /// where the daemon's folder is away. The run is interrupted as before then.
  void settle(std::string_view id, Recovery choice, std::string_view by, SettledTold told);
  /// What to check for recover(). Errors: not_found; wrong_state.
  [[nodiscard]] Result<CampaignRequest> request_to_recover(std::string_view id) const;
  /// Puts an interrupted run in line again, to go on where it was. What its file says is looked at
  /// when it begins. Errors: not_found, also where its campaign is not there any more; wrong_state;
  /// those of the check; io, where that cannot be written down.
  Result<RunView> recover(std::string_view id, std::string_view by, const Checked& checked);
  /// Both.
  Result<RunView> recover(std::string_view id, std::string_view by);
  /// The runs that wait, and in which order. Outlives the daemon. One that begins with runs in line
  /// holds them: somebody starts the line, or resets the rig.
  [[nodiscard]] const RunLine& line() const { return line_; }
  /// Another place in line for a run that waits, from 0. Errors: not_found, wrong_state.
  Status move(std::string_view id, std::size_t place, std::string_view by);
  /// Nothing more begins; the run under way goes on. Errors: wrong_state, when it is held already.
  Status hold_line(std::string_view by);
  /// Errors: wrong_state, when it is not held.
  Status start_line(std::string_view by);
  /// Stops motion now, whatever runs, and latches the rig until reset(). `reason`: why, where that
  /// is told. The same said again, of a rig that is latched, is counted in a line of the journal.
  void halt(std::string_view by, std::string_view reason = {});
  /// As halt(), and the latch is an emergency stop's: RigStanding::emergency. A halt after it
  /// leaves it one.
  void emergency_stop(std::string_view by, std::string_view reason = {});
  Status reset(std::string_view reason, std::string_view by);
  /// Lets a fault befall the bench of the run under way, once its devices are up, or ends some; it
  /// is in the run's journal and the daemon's. `told` is called once, on the desk's thread. Errors:
  /// wrong_state, without a run; BenchSession::befall()'s.
  void befall(FaultOrder order, FaultTold told);
  /// Where it is not safe nothing begins before reset(), but for the run that left it unknown, once
  /// somebody goes on with that: it ends the doubt or leaves it. Outlives the daemon.
  [[nodiscard]] const RigStanding& standing() const { return standing_; }
  /// So much room is awaited by the run that would begin next, where it is known; 0 without one.
  [[nodiscard]] std::uint64_t bytes_awaited() const;
  /// False: how the rig stands, a run, the line or a line of the journal could not be written down,
  /// and would be forgotten with the daemon. tick() tries again.
  [[nodiscard]] bool is_kept() const;

  [[nodiscard]] Result<RunView> get(std::string_view id) const;
  [[nodiscard]] std::vector<RunView> all() const;
  [[nodiscard]] std::optional<std::string> active() const;
  /// Calls back once, when the run has ended; at once where it has; never, once `listener` is gone.
  void when_ended(std::string_view id, std::function<void(const RunView&)> told,
                  std::weak_ptr<const void> listener);
  /// What became of its hand-over is told as part of the run.
  void hand_over_is(std::string_view id, const HandOverFact& fact);
  /// A line of the journal about what has happened; lines stay in order where the disk refuses
  /// them for a while.
  void note(std::string_view run, std::string_view kind, std::string_view by,
            std::string payload_json = "{}");
  /// Call often: deadlines, and what others did in the folders of runs that are over.
  void tick();
  /// The daemon is told to end: nothing more begins, and the run under way retracts the probe. It
  /// is interrupted then where anything of it is left, unless it had been told to end before. Tick
  /// on until it is_at_rest().
  void close();
  /// What would begin something, or lets it begin, is refused from then on, as wrong_state:
  /// submit(), recover(), settle(), start_line(), reset().
  [[nodiscard]] bool is_closing() const { return closing_; }
  /// Nothing is active(), or what is is lost(), and no interrupted run is being settled: what its
  /// folder says by then would not be known of it.
  [[nodiscard]] bool is_at_rest() const;
  /// The run that did not obey in time, whose thread has not come to an end: only the process's
  /// end ends it.
  [[nodiscard]] std::optional<std::string> lost() const;

 private:
  struct Run;
  [[nodiscard]] Status takes_more() const;
  void begin_next();
  [[nodiscard]] Run* next_in_line() const;
  bool is_rig_file_whole(const Run& next);
  void begin(Run& run);
  static std::uint64_t bytes_awaited(const Run& run);
  /// What its thread calls; most of it is done by the desk's.
  CampaignHooks hooks_of(Run& run, bool plan_is_known);
  void went_on(Run& run, const TrialProgress& line);
  void take_up_line();
  /// By somebody's wish, with a line of the journal: as it was where that cannot be kept.
  struct Wish {
    std::string_view run, kind, by;
    std::string payload_json = "{}";
  };
  Status line_becomes(RunLine next, const Wish& wish);
  /// By what has happened to its runs.
  void line_is(RunLine next, std::string_view by);
  /// Into the line or out of it by somebody's wish: `stored` with the machine's state, the line and
  /// a line of the journal, all of it or nothing.
  Status becomes(Run& run, StoredRun stored, const RunMachine& machine, std::string_view by);
  /// What keeps one run from its bench would cost all that wait.
  void hold_after(const Run& run, const Error& why);
  Run* numbered(std::int64_t number) const;
  void moved(Run& run, const RunMoment& moment);
  void ask(Run& run, const recipes::AskOperator& asked);
  [[nodiscard]] bool may_begin(const Run& run) const;
  void latch(std::string_view kind, std::string_view by, std::string_view reason, bool emergency);
  void note_stop(const RepeatedStops::Stop& stop, bool is_news);
  void note_repeated(const std::vector<RepeatedStops::Counted>& counted);
  void stand(const RigStanding& standing, std::string_view by);
  void keep_standing();
  void keep_line();
  void keep_again();
  void write_notes();
  /// What a run is told by, of a plan that may have a million trials.
  struct PlanKnown {
    std::size_t trials = 0;
    Deadlines limits{};
    std::optional<recipes::OperatorAsk> first_ask;
    std::uint64_t disk_bytes = 0;
  };
  static PlanKnown known_of(const recipes::Plan& plan);
  void plan_known(Run& run, const PlanKnown& plan);
  void tell_end(Run& run);
  static std::string_view outcome_of(const Run& run);
  static void refuse_faults(Run& run);
  [[nodiscard]] Result<CampaignRequest> request_of(const StoredRun& run) const;
  void apply(Run& run, const RunStep& step, std::string_view by);
  /// Of one that did not obey in time: its thread may come to an end yet.
  void lose(Run& run);
  void doubt_rig_of(const Run& run, std::string_view by);
  [[nodiscard]] static bool ends_as_before(const Run& run, bool had_rig);
  /// How it ended. Of one that came to the bench before and only concludes, that is its bench's
  /// end.
  void take_down(Run& run, const Result<CampaignSummary>& summary, std::string_view cut_short);
  void ended(Run& run, const Result<CampaignSummary>& summary, bool may_go_on);
  void look(Run& run);
  /// A run that may have been gone on with from elsewhere, and what was seen in its folder.
  struct Look {
    Run* run;
    std::filesystem::path folder;
    std::string dataset_sha256;
    std::optional<std::filesystem::file_time_type> certified_at;
    std::optional<CampaignSince> since = {};
  };
  static bool may_be_gone_on_with(const Run& run);
  void look_at_folders();
  static bool has_news(Look& look);
  void seen(const Look& look);
  void settled(Run& run, Recovery choice, std::string_view by,
               const Result<CampaignSummary>& summary, const SettledTold& told);
  void note_rejected(Run& run, const TrialProgress& line);
  void tell(Run& run, std::string_view by);
  [[nodiscard]] RunView shown(const Run& run) const;
  void keep(Run& run);
  /// On the run's thread: nothing moves before it is written down that the run has the rig.
  Status take_rig(Run& run);
  static void give_leave(Run& run, bool given);
  bool count_trials(Run& run);
  void name_time(RunView& view) const;
  [[nodiscard]] std::chrono::nanoseconds wall_ahead() const;
  Run* find(std::string_view id) const;
  /// How what is left of an ended run can still be recorded; empty where that is nothing.
  static std::string way_on(const Run& run);
  [[nodiscard]] Result<Run*> interrupted(std::string_view id) const;

  Surroundings around_;
  RunStore& store_;
  std::vector<std::unique_ptr<Run>> runs_;  // oldest first
  RunLine line_;
  RigStanding standing_;
  bool standing_kept_ = true, line_kept_ = true;
  bool closing_ = false;
  bool disk_is_awaited_ = false;  ///< its folder or its room, which keeps a run from its beginning
  RepeatedStops repeated_stops_;
  Clock next_look_{};  ///< at the folders of runs that are over
  std::jthread folder_reader_;
  std::deque<RunStore::Line> notes_;       // not in the journal yet
  std::int64_t asks_ = 0;                  ///< so many names of asks are taken, in other lives too
  std::chrono::nanoseconds wall_ahead_{};  ///< of the monotonic clock, when times were told last
  std::string
      trusted_;  ///< the run that somebody goes on with, knowing that it left the rig unknown
};

}  // namespace weft::daemon::control
