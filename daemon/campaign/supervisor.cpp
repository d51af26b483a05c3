#include "daemon/campaign/supervisor.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "daemon/base/text/format.hpp"

namespace weft::daemon {
namespace {

// Stiffness of the stop that carries part of the probe's weight: fabric and stop in series are
// never stiffer (docs/reference/plant.md).
constexpr double stop_stiffness_npm = 2e5;
// The loop's gain is stable with readings up to this number of cycles late (force_loop.hpp).
constexpr double most_late_cycles = 2;

}  // namespace

Supervisor::Supervisor(const recipes::Plan& plan, Loop& loop, Bench& bench,
                       TrialRecording& recording, SupervisorHooks hooks)
    : plan_(&plan),
      loop_(&loop),
      bench_(&bench),
      recording_(&recording),
      hooks_(std::move(hooks)),
      actions_(plan.limits, loop, bench,
               [this](recipes::Event event) { dispatch(std::move(event)); }),
      period_(from_seconds(1.0 / plan.limits.cycle_hz)) {
  force_config_.cycle_s = 1.0 / plan.limits.cycle_hz;
  force_config_.max_acceleration_mps2 = plan.limits.max_acceleration_mps2;
  bench_->on_sensor_sample([this](const Device& device, const Sample& sample) {
    recording_->sensor(sample, device.entry().name);
    if (hooks_.sensed) hooks_.sensed(sample, recording_->phase());
  });
}

Supervisor::~Supervisor() {
  bench_->on_sensor_sample({});
  loop_->cancel(cycle_timer_);
  loop_->cancel(engine_timer_);
}

void Supervisor::start(recipes::Start from) {
  last_cycle_ = loop_->now();
  cycle_due_ = last_cycle_ + period_;
  cycle_timer_ = loop_->at(cycle_due_, [this] { cycle(); });
  dispatch(from);
}

void Supervisor::request(recipes::Event event) {
  dispatch(std::move(event));
}

void Supervisor::dispatch(recipes::Event event) {
  events_.dispatch(std::move(event), [this](const recipes::Event& next) {
    recipes::Transition transition = recipes::step(*plan_, state_, next, loop_->now());
    state_ = std::move(transition.next);
    for (const recipes::Effect& effect : transition.effects)
      std::visit([this](const auto& e) { carry_out(e); }, effect);
  });
}

const recipes::PromptOperator* Supervisor::requested() const {
  return state_.step == recipes::Step::awaiting_operator ? &requested_ : nullptr;
}

void Supervisor::carry_out(const recipes::PromptOperator& effect) {
  requested_ = effect;
}

void Supervisor::carry_out(const recipes::TrialBegin& effect) {
  recording_->begin(effect.trial, loop_->now());
  if (hooks_.trial_begun) hooks_.trial_begun(effect.trial);
}

void Supervisor::carry_out(const recipes::MountFabric& effect) {
  const auto done = [this, alive = std::weak_ptr(alive_), ticket = effect.ticket,
                     fabric = effect.fabric](const Status& mounted) {
    if (alive.expired() || state_.ticket != ticket) return;
    if (mounted) return dispatch(recipes::Mounted{ticket});
    dispatch(recipes::Fault{Error(mounted.error()).in("mount " + fabric)});
  };
  hooks_.mount(effect, done);
}

void Supervisor::carry_out(const recipes::HoldForce& effect) {
  actions_.end_force_way();
  const recipes::SettleDetector settle{effect.band_n, effect.dwell_s};
  regulation_ = Regulation{.order = effect,
                           .loop = {},
                           .settle = settle,
                           .force_n = bench_->snapshot().wrench.force_n[2],
                           .latency = recipes::ForceLatency(to_seconds(period_))};
  force_config_.stiffness_initial_npm = effect.force_n < plan_->limits.probe_weight_n
                                            ? stop_stiffness_npm
                                            : recipes::ForceLoopConfig{}.stiffness_initial_npm;
}

void Supervisor::carry_out(const recipes::ReleaseForce&) {
  if (!std::exchange(regulation_, {})) return;
  actions_.set_still(StageAxis::z);
}

void Supervisor::carry_out(const recipes::SetPhase& effect) {
  const Phase before = recording_->phase();
  recording_->set_phase(effect.phase, loop_->now());
  if (before == Phase::rest || before == Phase::end) {
    const RestTally& rest = recording_->rest(before);
    if (rest.count() > 0) dispatch(recipes::RestMeasured{before, rest.mean_n(), rest.error_n()});
  }
  if (effect.phase == Phase::none && recording_->trial_bad())
    dispatch(recipes::AttemptRejected{*recording_->trial_bad()});
}

void Supervisor::carry_out(const recipes::ArmTimer& effect) {
  loop_->cancel(engine_timer_);
  deadline_ = effect.deadline;
  engine_timer_ = loop_->at(effect.deadline, [this, ticket = effect.ticket] {
    dispatch(recipes::TimerExpired{ticket, still_awaited()});
  });
}

void Supervisor::carry_out(const recipes::StopMotion&) {
  regulation_.reset();
  actions_.stop();
}

void Supervisor::carry_out(const recipes::TrialDone& effect) {
  recording_->end(effect.outcome, effect.ended_early, loop_->now());
  if (hooks_.trial_done) hooks_.trial_done(effect, recording_->trial_force());
}

void Supervisor::carry_out(const recipes::CampaignDone& effect) {
  loop_->cancel(cycle_timer_);
  loop_->cancel(engine_timer_);
  result_ = effect;
}

// The scan cycle: read, check the guards, check orders in progress, regulate, poll.

namespace {

// All stages are recorded, and all but z are read, once in this number of cycles.
constexpr std::uint64_t slow_divisor = recipes::RigLimits::cycles_per_stage_row;

// A larger difference between a cycle's mean and the newest reading means that the force moves. Or
// the mean contains a reading that no guard has checked.
constexpr double mean_tolerance_n = 0.1;

/// Normal force of a cycle: the mean of its readings, or the newest, which the guards have passed.
double force_of(const Snapshot& seen) {
  const double newest_n = seen.wrench.force_n[2];
  const double mean_n = seen.wrench_recent.mean().force_n[2];
  return std::abs(mean_n - newest_n) <= mean_tolerance_n ? mean_n : newest_n;
}

}  // namespace

void Supervisor::cycle() {
  const TimePoint now = loop_->now();
  const Duration since_last = now - std::exchange(last_cycle_, now);
  ++cycles_;
  if (guarded(since_last)) {
    actions_.check_all();
    if (state_.step == recipes::Step::sliding && hooks_.slid_enough && hooks_.slid_enough())
      dispatch(recipes::EndSlide{});
    regulate(since_last);
  }
  if (cycles_ % slow_divisor == 0) recording_->stages(bench_->snapshot(), now);
  actions_.poll(cycles_);
  recording_->commit_if_due();
  // Counted from the due time, not from the actual time: lateness does not slow the rate. Missed
  // cycles are not made up.
  cycle_due_ = std::max(cycle_due_ + period_, now);
  if (!result_) cycle_timer_ = loop_->at(cycle_due_, [this] { cycle(); });
}

// Whether this cycle may send commands. After a fault or a trip, only the engine's own answer
// (stop, retract) is sent in this cycle. A retract in progress continues to its end.
bool Supervisor::guarded(Duration since_last) {
  const bool retreating = state_.step == recipes::Step::retracting;
  const std::size_t events = trips_;
  if (const Error* error = bench_->fault()) trip(recipes::Fault{*error});
  if (recording_->error()) trip(recipes::Fault{*recording_->error()});
  if (const auto guard = actions_.check_guards(guard_context(since_last))) {
    const bool at_leisure = guard->action == recipes::GuardAction::finish_trial;
    if (at_leisure)
      dispatch(recipes::GuardTripped{*guard});
    else
      trip(recipes::GuardTripped{*guard});
  }
  if (trips_ == events) return true;
  if (retreating) actions_.check_motion();
  return false;
}

GuardContext Supervisor::guard_context(Duration since_last) const {
  // Mounting a fabric touches the plate, and a bias moves the zero.
  const bool zero_moves = state_.step < recipes::Step::approaching;
  return {deadline_, since_last, recording_->free_bytes(), zero_moves};
}

void Supervisor::trip(recipes::Event event) {
  ++trips_;
  dispatch(std::move(event));
}

void Supervisor::regulate(Duration since_last) {
  if (!regulation_) return;
  const Snapshot& seen = bench_->snapshot();
  const bool fresh = seen.wrench_recent.readings > 0;
  if (fresh) regulation_->force_n = force_of(seen);
  const double force_n = regulation_->force_n;
  const double dt_s = to_seconds(since_last);
  recipes::ForceLoopInput input;
  input.setpoint_n = regulation_->order.force_n;
  input.force_n = force_n;
  input.z_m = seen.stage[recipes::index(StageAxis::z)].position;
  input.dt_s = dt_s;
  input.fresh = fresh;
  input.learn_stiffness = state_.step != recipes::Step::sliding;
  regulation_->latency.add(input.z_m, force_n);
  const recipes::ForceCommand wanted = recipes::step(force_config_, regulation_->loop, input);
  actions_.drive(StageAxis::z, wanted.velocity_mps);
  if (!regulation_ || regulation_->settled) return;
  if (!regulation_->settle.step(force_n - regulation_->order.force_n, dt_s)) return;
  regulation_->settled = true;
  dispatch(recipes::ForceSettled{regulation_->order.ticket});
}

std::optional<Error> Supervisor::still_awaited() const {
  if (auto awaited = actions_.still_awaited()) return awaited;
  if (!regulation_ || regulation_->settled) return std::nullopt;
  const std::string sensor = bench_->wrench().entry().name;
  const std::optional<double> late_s = regulation_->latency.estimate_s();
  const double limit_s = most_late_cycles * force_config_.cycle_s;
  if (late_s && *late_s > limit_s + force_config_.cycle_s / 2)
    return Error{.code = Errc::timeout,
                 .where = sensor,
                 .what = "force readings too late for the force loop",
                 .expected = "at most " + duration(limit_s) +
                             " behind the stage, which is two cycles of the loop",
                 .got = duration(*late_s),
                 .hint =
                     "Check the filter and averaging of the sensor, the network or the USB latency "
                     "timer, and the load of this computer (weft doctor)"};
  return Error{.code = Errc::timeout,
               .where = sensor,
               .what = "force did not settle",
               .expected = fixed(regulation_->order.force_n, 2) + " N within " +
                           fixed(regulation_->order.band_n, 2) + " N for " +
                           duration(regulation_->order.dwell_s),
               .got = fixed(regulation_->force_n, 2) + " N",
               .hint = "Check the probe mount, the fabric, and what shakes the plate"};
}

}  // namespace weft::daemon
