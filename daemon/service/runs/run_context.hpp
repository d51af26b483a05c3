#pragma once
// A run as clients see it, what is called when it, the queue or the rig changes, and what else the
// parts of daemon/service/runs are given from outside.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/campaign/bench_check.hpp"
#include "daemon/campaign/campaign.hpp"
#include "daemon/campaign/maintenance.hpp"
#include "daemon/service/run_model/operator_prompts.hpp"
#include "daemon/service/run_store/run_store.hpp"
#include "daemon/storage/certificate/handover_file.hpp"

namespace weft::daemon::runs {

/// What the folder of an ended run holds, where its campaign was resumed afterwards by
/// `weft run --resume` and not by the daemon.
struct ExternalResume {
  std::size_t trials_done = 0, trials_planned = 0;
  bool complete = false;  ///< it came to its end with all of them
  std::string dataset_sha256;
  friend bool operator==(const ExternalResume&, const ExternalResume&) = default;
};

struct RunView {
  StoredRun stored;
  RunStateMachine machine;
  std::optional<RunStatusUpdate> moment;
  std::optional<LiveVoteUpdate> vote;             ///< the newest of its recipe's live votes
  std::optional<OperatorPrompt> operator_prompt;  ///< the next human action
  std::size_t trials_done = 0;
  std::size_t trials_planned = 0;
  bool is_blocked = false;  ///< it waits for a run that has ended otherwise than complete
  bool pause_is_carried_over = false;  ///< to the queue: no repetition was left to take it
  std::size_t attempts_rejected = 0;   ///< bad ones that were taken again
  std::string last_rejection;          ///< why the newest of them was
  std::optional<double> force_rms_error_n = {};  ///< of the newest trial, while the force was held
  std::uint64_t frames_lost = 0;                 ///< until the newest trial [count]
  std::optional<double> recorder_lag_s = {};     ///< longest commit of the newest trial
  std::optional<double> wall_left_s = {};        ///< until it is over, see RunForecast
  std::string changed_by;                        ///< the user, session or rule that changed it last
  std::optional<HandoverStatus> handover;        ///< where its recipe has one and it is complete
  /// Whether its recipe has one, once the run has ended in this life of the daemon.
  std::optional<bool> has_handover = {};
  std::optional<ExternalResume> external_resume = {};

  [[nodiscard]] RunState state() const { return machine.state; }
  [[nodiscard]] bool is_over() const {
    return state() == RunState::ended || state() == RunState::interrupted;
  }
};

/// Called on the server's thread, when the change is written or waits to be. `by`: a user, a
/// session or a rule.
class RunObserver {
 public:
  RunObserver() = default;
  RunObserver(const RunObserver&) = delete;
  RunObserver& operator=(const RunObserver&) = delete;
  virtual ~RunObserver() = default;
  virtual void on_run_changed(const RunView& run) = 0;
  /// It is over and not in memory any more: RunManager::get() reads it from the store.
  virtual void on_run_unloaded(std::int64_t run) = 0;
  virtual void on_vote(const RunView& run) = 0;
  virtual void on_queue_changed(const RunQueue& queue, std::string_view by) = 0;
  /// Also of a halt that changes nothing.
  virtual void on_rig_state_changed(const RigState& rig, std::string_view by) = 0;
};
/// For a manager that nobody watches.
struct SilentObserver final : RunObserver {
  void on_run_changed(const RunView& /*run*/) override {}
  void on_run_unloaded(std::int64_t /*run*/) override {}
  void on_vote(const RunView& /*run*/) override {}
  void on_queue_changed(const RunQueue& /*queue*/, std::string_view /*by*/) override {}
  void on_rig_state_changed(const RigState& /*rig*/, std::string_view /*by*/) override {}
};
inline SilentObserver no_observer;

struct RunContext {
  std::filesystem::path rig;                        ///< rig file
  std::filesystem::path data;                       ///< one folder for each run
  std::function<void(std::function<void()>)> post;  ///< onto the server's thread, from any
  std::function<std::chrono::nanoseconds()> now;    ///< monotonic
  std::function<std::int64_t()> utc_us;
  RunObserver* observer = &no_observer;       ///< outlives the manager
  LiveFrameSampler* frame_sampler = nullptr;  ///< shown what the run under way senses
  const BenchPace* pace = nullptr;            ///< of a simulated bench
  /// The machine's wall clock, which people compare times ahead with; it may be set back.
  std::function<std::int64_t()> wall_us = {};
  /// Handover of a run that is over; nothing where it has none.
  std::function<std::optional<HandoverStatus>(std::int64_t run)> find_handover = {};
  /// What a run is, on its thread.
  std::function<Result<CampaignSummary>(const CampaignRequest&, const CampaignHooks&)> perform =
      run_campaign;
  /// What motion outside a run is, on its thread.
  std::function<Result<MaintenanceSummary>(const MaintenanceRequest&, const MaintenanceHooks&)>
      maintain = run_maintenance;
  /// Where a simulated bench was left; used by one such thread at a time.
  std::shared_ptr<SimulatedPlace> place = std::make_shared<SimulatedPlace>();
  /// Whether a folder has space for a number of bytes.
  std::function<Status(const std::filesystem::path&, std::uint64_t)> check_space =
      daemon::check_space;
  /// Whether a rig file can be run, as far as that is known without a recipe.
  std::function<Status(const std::filesystem::path&)> check_rig_file = daemon::check_rig_file;
  /// Of the daemon inside `weft run`: after the first submit() every other is refused, the run has
  /// no deadline but those that follow an order, and ends for good.
  bool one_run = false;
};

}  // namespace weft::daemon::runs
