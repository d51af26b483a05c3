#pragma once
// Thread of the active run: it performs the campaign, takes orders and faults, and requests the rig
// before any motion. It posts its reports to the server's thread.

#include <atomic>
#include <functional>
#include <optional>
#include <thread>

#include "daemon/campaign/orders/run_forecast.hpp"
#include "daemon/service/runs/run_context.hpp"

namespace weft::daemon::runs {

/// Facts of a plan that the manager keeps; the plan itself may have a million trials.
struct PlanSummary {
  std::size_t trials = 0;
  Deadlines limits{};
  std::optional<recipes::StepPrompt> first_prompt;
  std::uint64_t disk_bytes = 0;
  PlannedTime time = {};  ///< of a run from its first trial
};
PlanSummary summarize(const recipes::Plan& plan, bool is_real_time);

/// How the run's thread ended.
struct RunResult {
  Result<CampaignSummary> summary = {};
  bool can_resume = false;    ///< trials or the data set are left to finish
  bool acquired_rig = false;  ///< it requested the rig and was not refused
  bool is_checked = false;    ///< the request passed the checks
  bool was_ordered = false;   ///< an order ended it
};

/// Reports of a run's thread, called on the server's thread.
class RunReports {
 public:
  virtual void on_plan(std::int64_t run, const PlanSummary& plan) = 0;
  virtual void on_moment(std::int64_t run, const RunStatusUpdate& moment) = 0;
  virtual void on_vote(std::int64_t run, const LiveVoteUpdate& vote) = 0;
  virtual void on_progress(std::int64_t run, const TrialProgress& line) = 0;
  /// The run is about to acquire the rig. False: it must not.
  virtual bool grant_rig(std::int64_t run) = 0;
  virtual void on_thread_ended(std::int64_t run, const RunResult& result) = 0;

 protected:
  ~RunReports() = default;
};

/// Author of the order that ends a run when the daemon ends.
inline constexpr const char* by_shutdown = "auto:shutdown";

using FaultCallback = std::function<void(const Status&)>;

/// One run at a time. Thread: the server's.
class RunExecutor {
 public:
  /// `context` and `reports` must outlive it.
  RunExecutor(const RunContext& context, RunReports& reports)
      : context_(context), reports_(reports) {}
  RunExecutor(const RunExecutor&) = delete;
  RunExecutor& operator=(const RunExecutor&) = delete;
  ~RunExecutor() { stop(); }

  /// If `request` is an error, the run ends with it.
  void begin(std::int64_t run, bool plan_is_known, Result<CampaignRequest> request, bool resumes);
  /// The active run; empty once its end was reported.
  [[nodiscard]] std::optional<std::int64_t> run() const { return run_; }
  /// True if that run was granted the rig.
  [[nodiscard]] bool has_rig() const { return grant_ == Grant::given; }
  void give(GivenOrder order) { orders_->give(std::move(order)); }
  /// Call when the daemon ends: unless an order has ended the run already, it becomes interrupted
  /// if trials are left.
  void cut() { cut_ = !orders_ || !orders_->ends_run(); }
  /// Injects a fault into the active run's bench, once its devices are open, or ends faults.
  /// `on_done` is called once, on the server's thread.
  void inject(FaultOrder order, FaultCallback on_done);
  /// Aborts the run and waits for its thread; nothing is reported afterwards.
  void stop();

 private:
  enum class Grant : std::uint8_t { awaited, given, refused };
  CampaignHooks hooks_for(bool plan_is_known);
  void perform(const Result<CampaignRequest>& request, bool resumes, const CampaignHooks& hooks);
  Status acquire_rig();
  void set_grant(bool given);
  void on_last_message();

  const RunContext& context_;
  RunReports& reports_;
  std::optional<std::int64_t> run_;
  std::optional<RunOrders> orders_;            ///< of the newest run; none before the first
  std::atomic<Grant> grant_ = Grant::awaited;  ///< the thread waits for it
  std::atomic<bool> cut_ = false;              ///< read by the thread
  RunResult result_;                           ///< written by the thread until joined
  std::jthread thread_;
};

}  // namespace weft::daemon::runs
