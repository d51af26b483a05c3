#pragma once
// A run as clients see it, the observer of changes of runs, queue and rig, and the external
// dependencies of daemon/service/runs.

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

/// State of an ended run's folder after it was resumed outside the daemon (`weft run --resume`).
struct ExternalResume {
  std::size_t trials_done = 0, trials_planned = 0;
  bool complete = false;  ///< ended with all trials
  std::string dataset_sha256;
  friend bool operator==(const ExternalResume&, const ExternalResume&) = default;
};

struct RunView {
  StoredRun stored;
  RunStateMachine machine;
  std::optional<RunStatusUpdate> moment;
  std::optional<LiveVoteUpdate> vote;             ///< the newest live vote
  std::optional<OperatorPrompt> operator_prompt;  ///< the open or next operator prompt
  std::size_t trials_done = 0;
  std::size_t trials_planned = 0;
  bool is_blocked = false;             ///< the run that it follows has ended, but not complete
  bool pause_is_carried_over = false;  ///< to the queue, as no repetition was left
  std::size_t attempts_rejected = 0;   ///< rejected attempts, repeated
  std::string last_rejection;          ///< reason of the newest one
  std::optional<double> force_rms_error_n = {};  ///< newest trial, while the force was regulated
  std::uint64_t frames_lost = 0;                 ///< up to the newest trial [count]
  std::optional<double> recorder_lag_s = {};     ///< longest commit of the newest trial [s]
  std::optional<double> wall_left_s = {};        ///< until the run ends, see RunForecast
  std::string changed_by;                        ///< user, session or rule of the last change
  std::optional<HandoverStatus> handover;        ///< if its recipe has one and it is complete
  /// Whether its recipe has one; known once the run has ended under this daemon.
  std::optional<bool> has_handover = {};
  std::optional<ExternalResume> external_resume = {};

  [[nodiscard]] RunState state() const { return machine.state; }
  [[nodiscard]] bool is_over() const {
    return state() == RunState::ended || state() == RunState::interrupted;
  }
};

/// Called on the server's thread, when the change is written or its write is postponed. `by`: a
/// user, a session or a rule.
class RunObserver {
 public:
  RunObserver() = default;
  RunObserver(const RunObserver&) = delete;
  RunObserver& operator=(const RunObserver&) = delete;
  virtual ~RunObserver() = default;
  virtual void on_run_changed(const RunView& run) = 0;
  /// The ended run is no longer in memory: RunManager::get() reads it from the store.
  virtual void on_run_unloaded(std::int64_t run) = 0;
  virtual void on_vote(const RunView& run) = 0;
  virtual void on_queue_changed(const RunQueue& queue, std::string_view by) = 0;
  /// Also for a halt that changes nothing.
  virtual void on_rig_state_changed(const RigState& rig, std::string_view by) = 0;
};
/// For a manager without observer.
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
  std::function<void(std::function<void()>)> post;  ///< to the server's thread, from any
  std::function<std::chrono::nanoseconds()> now;    ///< monotonic
  std::function<std::int64_t()> utc_us;
  RunObserver* observer = &no_observer;       ///< must outlive the manager
  LiveFrameSampler* frame_sampler = nullptr;  ///< receives the active run's samples
  const BenchPace* pace = nullptr;            ///< simulation speed of a simulated bench
  /// The machine's wall clock, for times shown to people; it may be set back.
  std::function<std::int64_t()> wall_us = {};
  /// Handover of an ended run; empty if it has none.
  std::function<std::optional<HandoverStatus>(std::int64_t run)> find_handover = {};
  /// Performs a run; called on the run's thread.
  std::function<Result<CampaignSummary>(const CampaignRequest&, const CampaignHooks&)> perform =
      run_campaign;
  /// Performs a motion outside a run; called on its thread.
  std::function<Result<MaintenanceSummary>(const MaintenanceRequest&, const MaintenanceHooks&)>
      maintain = run_maintenance;
  /// Position in which a simulated bench was left; used by one such thread at a time.
  std::shared_ptr<SimulatedPlace> place = std::make_shared<SimulatedPlace>();
  /// Checks that a folder has space for a number of bytes.
  std::function<Status(const std::filesystem::path&, std::uint64_t)> check_space =
      daemon::check_space;
  /// Checks that a rig file can be run, as far as possible without a recipe.
  std::function<Status(const std::filesystem::path&)> check_rig_file = daemon::check_rig_file;
  /// For the daemon inside `weft run`: it accepts one submit() only. The run has no deadlines
  /// except after an order, and cannot be resumed by the daemon.
  bool one_run = false;
};

}  // namespace weft::daemon::runs
