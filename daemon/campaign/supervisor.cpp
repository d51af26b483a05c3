#include "daemon/campaign/supervisor.hpp"

#include <utility>

namespace weft::daemon {

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
  hooks_.mount(effect.fabric, effect.patch_seed, done);
}

void Supervisor::carry_out(const recipes::MoveTo& effect) {
  actions_.begin(effect);
}

void Supervisor::carry_out(const recipes::BiasSensors& effect) {
  actions_.begin(effect);
}

void Supervisor::carry_out(const recipes::Descend& effect) {
  actions_.begin(effect);
}

void Supervisor::carry_out(const recipes::HoldForce& effect) {
  actions_.end_descent();
  const recipes::SettleDetector settle{effect.band_n, effect.dwell_s};
  regulation_ = Regulation{effect, {}, settle, bench_->snapshot().wrench.force_n[2]};
}

void Supervisor::carry_out(const recipes::ReleaseForce&) {
  if (!std::exchange(regulation_, {})) return;
  actions_.set_still(StageAxis::z);
}

void Supervisor::carry_out(const recipes::SetPhase& effect) {
  recording_->set_phase(effect.phase, loop_->now());
  if (effect.phase == Phase::none && recording_->trial_bad())
    dispatch(recipes::AttemptRejected{*recording_->trial_bad()});
}

void Supervisor::carry_out(const recipes::ArmTimer& effect) {
  loop_->cancel(engine_timer_);
  deadline_ = effect.deadline;
  engine_timer_ = loop_->at(effect.deadline, [this, ticket = effect.ticket] {
    dispatch(recipes::TimerExpired{ticket, actions_.still_awaited()});
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

}  // namespace weft::daemon
