#pragma once
// The thread of the run that has its turn: it performs the campaign, takes orders and faults, asks
// for the rig before anything moves, and posts what happens to the server's thread.

#include <atomic>
#include <functional>
#include <optional>
#include <thread>

#include "daemon/campaign/orders/run_forecast.hpp"
#include "daemon/service/runs/run_context.hpp"

namespace weft::daemon::runs {

/// What the manager keeps of a plan, which may have a million trials.
struct PlanSummary {
  std::size_t trials = 0;
  Deadlines limits{};
  std::optional<recipes::StepPrompt> first_prompt;
  std::uint64_t disk_bytes = 0;
  PlannedTime time = {};  ///< of a run from its first trial
};
PlanSummary summarize(const recipes::Plan& plan, bool is_real_time);

/// How a run thread came to its end.
struct RunResult {
  Result<CampaignSummary> summary = {};
  bool can_resume = false;    ///< something is left to record or to conclude
  bool acquired_rig = false;  ///< it asked for the rig, and was not refused
  bool is_checked = false;    ///< what it was asked for can be done
  bool was_ordered = false;   ///< an order ended it
};

/// What a run thread reports, called on the server's thread.
class RunReports {
 public:
  virtual void on_plan(std::int64_t run, const PlanSummary& plan) = 0;
  virtual void on_moment(std::int64_t run, const RunStatusUpdate& moment) = 0;
  virtual void on_vote(std::int64_t run, const LiveVoteUpdate& vote) = 0;
  virtual void on_progress(std::int64_t run, const TrialProgress& line) = 0;
  /// The run is about to take the rig. False: it must not.
  virtual bool grant_rig(std::int64_t run) = 0;
  virtual void on_thread_ended(std::int64_t run, const RunResult& result) = 0;

 protected:
  ~RunReports() = default;
};

/// Who ends a run when the daemon ends.
inline constexpr const char* by_shutdown = "auto:shutdown";

using FaultCallback = std::function<void(const Status&)>;

/// One run at a time. Used by the server's thread.
class RunExecutor {
 public:
  /// Both outlive it.
  RunExecutor(const RunContext& context, RunReports& reports)
      : context_(context), reports_(reports) {}
  RunExecutor(const RunExecutor&) = delete;
  RunExecutor& operator=(const RunExecutor&) = delete;
  ~RunExecutor() { stop(); }

  /// An error in place of the request is how the run ends.
  void begin(std::int64_t run, bool plan_is_known, Result<CampaignRequest> request, bool resumes);
  /// The run under way: its thread has not reported its end.
  [[nodiscard]] std::optional<std::int64_t> run() const { return run_; }
  /// Whether that run has the rig: it may ask, or be about to.
  [[nodiscard]] bool has_rig() const { return grant_ == Grant::given; }
  void give(GivenOrder order) { orders_->give(std::move(order)); }
  /// The daemon ends: where no order has ended the run yet, it is interrupted if anything is left.
  void cut() { cut_ = !orders_ || !orders_->ends_run(); }
  /// Injects a fault into the bench of the run under way, once its devices are up, or ends some.
  /// `on_done` is called once, on the server's thread.
  void inject(FaultOrder order, FaultCallback on_done);
  /// Aborts the run and waits for its thread; nothing is reported any more.
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
  std::optional<RunOrders> orders_;            ///< of the newest run; nothing before the first
  std::atomic<Grant> grant_ = Grant::awaited;  ///< the thread waits for it
  std::atomic<bool> cut_ = false;              ///< read by the thread
  RunResult result_;                           ///< of the thread, until it is joined
  std::jthread thread_;
};

}  // namespace weft::daemon::runs
