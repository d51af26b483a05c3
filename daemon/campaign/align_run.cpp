#include "daemon/campaign/align_run.hpp"

#include <algorithm>
#include <utility>

#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/campaign/bench_check.hpp"

namespace weft::daemon {
AlignRun::AlignRun(const recipes::AlignPlan& plan, Loop& loop, Bench& bench)
    : plan_(&plan),
      loop_(&loop),
      bench_(&bench),
      actions_(plan.limits, loop, bench,
               [this](recipes::Event event) { dispatch(std::move(event)); }),
      period_(from_seconds(1.0 / plan.limits.cycle_hz)) {}

AlignRun::~AlignRun() {
  loop_->cancel(cycle_timer_);
  loop_->cancel(step_timer_);
}

void AlignRun::start() {
  last_cycle_ = loop_->now();
  cycle_due_ = last_cycle_ + period_;
  cycle_timer_ = loop_->at(cycle_due_, [this] { cycle(); });
  dispatch(recipes::Start{});
}

void AlignRun::cycle() {
  const TimePoint now = loop_->now();
  const Duration since_last = now - std::exchange(last_cycle_, now);
  ++cycles_;
  if (guarded(since_last)) {
    actions_.check_all();
  }
  if (result_) return;
  actions_.poll(cycles_);
  cycle_due_ = std::max(cycle_due_ + period_, now);
  cycle_timer_ = loop_->at(cycle_due_, [this] { cycle(); });
}

// Whether this cycle may command, as in a campaign: what trips is all that is told in it, and a
// retreat goes on to its end.
bool AlignRun::guarded(Duration since_last) {
  const bool retreating = state_.step == recipes::AlignStep::retracting;
  const bool zero_moves = state_.step < recipes::AlignStep::crossing;
  bool tripped = false;
  if (const Error* error = bench_->fault()) {
    tripped = true;
    dispatch(recipes::Fault{*error});
  }
  if (const auto guard = actions_.check_guards({deadline_, since_last, {}, zero_moves})) {
    tripped = true;
    dispatch(recipes::GuardTripped{*guard});
  }
  if (tripped && retreating) actions_.check_motion();
  return !tripped;
}

void AlignRun::dispatch(recipes::Event event) {
  events_.dispatch(std::move(event), [this](const recipes::Event& next) {
    recipes::AlignTransition transition = recipes::step(*plan_, state_, next, loop_->now());
    state_ = std::move(transition.next);
    for (const recipes::AlignEffect& effect : transition.effects)
      std::visit([this](const auto& e) { carry_out(e); }, effect);
  });
}

void AlignRun::carry_out(const recipes::ArmTimer& timer) {
  loop_->cancel(step_timer_);
  deadline_ = timer.deadline;
  step_timer_ = loop_->at(timer.deadline, [this, ticket = timer.ticket] {
    dispatch(recipes::TimerExpired{ticket, actions_.still_awaited()});
  });
}

void AlignRun::carry_out(const recipes::AlignDone& done) {
  loop_->cancel(cycle_timer_);
  loop_->cancel(step_timer_);
  result_ = done;
}

Result<AlignSummary> run_alignment(const AlignRequest& request) {
  const auto opened = open_rig(request.rig, request.plugins);
  if (!opened) return pass(opened.error());
  const auto& [rig, limits] = *opened;
  const auto plan = recipes::plan_alignment(limits, request.settings);
  if (!plan) return pass(plan.error(), request.rig.string());
  auto session = open_session({rig, request.rig, limits, request.seed});
  if (!session) return pass(session.error());
  const auto stop_requested = [&] { return request.stop != nullptr && request.stop->load(); };
  const DeviceLog log((*session)->bench(), (*session)->loop(), request.device_log);
  if (Status up = bring_up(**session, stop_requested); !up) return pass(up.error());
  AlignRun run(*plan, (*session)->loop(), (*session)->bench());
  run.start();
  recipes::Ticket reported = 0;
  bool stopping = false;
  (*session)->run_until([&] {
    if (stop_requested() && !std::exchange(stopping, true)) run.request(recipes::AbortRequested{});
    if (request.moved_on && std::exchange(reported, run.state().ticket) != run.state().ticket)
      request.moved_on(run.state());
    return run.result().has_value();
  });
  if (!run.result())
    return fail({.code = Errc::timeout, .where = "bench", .what = "the bench fell silent"});
  const auto ended = std::chrono::duration_cast<std::chrono::seconds>(utc_now());
  return AlignSummary{rig.name,      rig.bench,          *plan,
                      *run.result(), run.state().rounds, to_seconds((*session)->loop().now()),
                      ended.count()};
}

}  // namespace weft::daemon
