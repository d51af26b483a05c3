#include "daemon/service/runs/run_executor.hpp"

#include <algorithm>
#include <utility>

#include "daemon/base/loop/threads.hpp"
#include "daemon/campaign/resume.hpp"
#include "recipes/engine/motion.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::daemon::runs {
namespace {

/// Deadlines for the longest run that the plan allows: every attempt except the last of each trial
/// is rejected. The current repetition may be the longest, with the longest settling time. The
/// final steps may use all of their budget: even after a stop the run may end complete.
Deadlines deadlines_of(const recipes::Plan& plan) {
  const std::vector<double> trials_s = recipes::trial_durations_s(plan);
  const recipes::Finally& last = plan.finally;
  const bool after_cut = !last.on_stop.empty() || !last.on_fault.empty();
  return Deadlines::of(plan.forecast.trials_s() * recipes::most_attempts(plan),
                       *std::max_element(trials_s.begin(), trials_s.end()) + plan.settle.timeout_s,
                       {.finally_s = recipes::is_empty(last) ? 0 : last.budget_s,
                        .finally_cut_s = after_cut ? last.budget_s : 0,
                        .retreat_s = recipes::retreat_timeout_s(plan)});
}

/// True if the recorded trials have no data set but may still get one. An unreadable file may
/// become readable again.
bool can_be_concluded(const std::filesystem::path& folder, const Result<CampaignSummary>& summary) {
  if (summary && !summary->dataset_error) return false;
  const auto only_end_left = is_only_end_left(folder);
  return only_end_left ? *only_end_left : summary.has_value();
}

}  // namespace

PlanSummary summarize(const recipes::Plan& plan, bool is_real_time) {
  return {plan.trials.size(), deadlines_of(plan), recipes::next_prompt(plan, 0),
          disk_forecast(plan), PlannedTime::of(plan, 0, is_real_time)};
}

void RunExecutor::begin(std::int64_t run, bool plan_is_known, Result<CampaignRequest> request,
                        bool resumes) {
  run_ = run;
  orders_.emplace();
  grant_ = Grant::awaited;
  cut_ = false;
  result_ = {};
  thread_ =
      std::jthread([this, hooks = hooks_for(plan_is_known), request = std::move(request), resumes] {
        perform(request, resumes, hooks);
        give_back_free_memory();
        context_.post([this] { on_last_message(); });
      });
}

void RunExecutor::perform(const Result<CampaignRequest>& request, bool resumes,
                          const CampaignHooks& hooks) {
  result_.summary = catch_as_error([&]() -> Result<CampaignSummary> {
    if (!request) return pass(request.error());
    CampaignHooks own = hooks;
    // Its trials must not depend on what this simulated bench did before.
    if (request->only_fabric) own.place = nullptr;
    return context_.perform(*request, own);
  });
  if (context_.one_run || (!request && !resumes)) return;
  if (resumes || cut_)
    result_.can_resume = !request || is_anything_left(*request);
  else
    result_.can_resume = can_be_concluded(request->out, result_.summary);
}

void RunExecutor::on_last_message() {
  thread_.join();
  RunResult result = std::exchange(result_, {});
  result.was_ordered = orders_->ends_run();
  while (orders_->next_fault()) continue;  // its destructor sends the reply
  reports_.on_thread_ended(*std::exchange(run_, std::nullopt), result);
}

CampaignHooks RunExecutor::hooks_for(bool plan_is_known) {
  const auto report = [this](auto method) {
    return [this, method, run = *run_](const auto& what) {
      context_.post([this, method, run, what] { (reports_.*method)(run, what); });
    };
  };
  CampaignHooks hooks;
  hooks.orders = &*orders_;
  hooks.frame_sampler = context_.frame_sampler;
  if (hooks.frame_sampler != nullptr) hooks.frame_sampler->begin(run_id(*run_));
  hooks.pace = context_.pace;
  hooks.place = context_.place.get();
  hooks.rig_acquired = [this] { return acquire_rig(); };
  hooks.planned = [this, plan_is_known,
                   known = report(&RunReports::on_plan)](const recipes::Plan& plan) {
    result_.is_checked = true;
    if (!plan_is_known) known(summarize(plan, runs_in_real_time(context_.rig)));
  };
  hooks.moment = report(&RunReports::on_moment);
  hooks.vote = report(&RunReports::on_vote);
  hooks.progress = report(&RunReports::on_progress);
  return hooks;
}

// On the run's thread: nothing moves before the record shows that the run has acquired the rig.
Status RunExecutor::acquire_rig() {
  result_.acquired_rig = true;
  context_.post([this] { set_grant(!orders_->ends_run() && reports_.grant_rig(*run_)); });
  grant_.wait(Grant::awaited);
  if (has_rig()) return {};
  result_.acquired_rig = false;
  if (orders_->ends_run())
    return fail({.code = Errc::wrong_state,
                 .where = "rig",
                 .what = "run ended before it acquired the rig"});
  return fail({.code = Errc::io,
               .where = context_.data.string(),
               .what = "cannot record that the run acquired the rig; the run was not started",
               .hint = "See weft status for the cause"});
}

void RunExecutor::set_grant(bool given) {
  grant_ = given ? Grant::given : Grant::refused;
  grant_.notify_all();
}

void RunExecutor::inject(FaultOrder order, FaultCallback on_done) {
  // Destroying the order sends its result, because possibly no bench ever takes it.
  const auto send = [post = context_.post, on_done = std::move(on_done)](Status* done) {
    post([on_done, reply = std::shared_ptr<Status>(done)] { on_done(*reply); });
  };
  const std::shared_ptr<Status> reply(
      new Status(fail({.code = Errc::wrong_state,
                       .where = "/rig",
                       .what = "run has ended",
                       .hint = "Start another run, or put faults for a whole run into the rig file "
                               "under simulation.faults"})),
      send);
  order.callback = [reply](const Status& done) { *reply = done; };
  orders_->give(std::move(order));
}

void RunExecutor::stop() {
  if (!thread_.joinable()) return;
  set_grant(false);
  orders_->give({Order::abort, by_shutdown});
  thread_.join();
}

}  // namespace weft::daemon::runs
