#include "daemon/run/supervisor.hpp"

#include <algorithm>
#include <utility>

namespace weft::daemon {
namespace {

using namespace std::chrono_literals;

// A reading so far from the last one is no force: the mount, at its stiffest and fastest, makes a
// tenth of that between two readings. Level L0 of the plant steps to its set point at once.
constexpr double jump_share = 0.4;
// Readings so many periods apart may differ by anything.
constexpr double jump_gap_readings = 5;
// A rotary stage reaches its speed within this time.
constexpr double tilt_ramp_s = 1;
// Some ten thousand trials of samples, or the write-ahead log of a reader that holds it back.
constexpr std::uint64_t least_free_bytes = std::uint64_t{64} << 20;

// How old a reading may be before the bench counts as blind: ten periods of its stream, and not
// less than what a busy host and a network may cost.
Duration max_age(double rate_hz, Duration least) {
  return std::max(from_seconds(10 / rate_hz), least);
}

recipes::GuardLimits guard_limits(const recipes::RigLimits& rig) {
  recipes::GuardLimits limits;
  limits.force_cap_n = rig.force_cap_n;
  limits.torque_cap_nm = rig.torque_cap_nm;
  limits.travel = rig.geometry.travel;
  limits.wrench_max_age = max_age(rig.wrench_rate_hz, 100ms);
  limits.taxels_max_age = max_age(rig.taxel_rate_hz, 500ms);
  limits.stage_max_age = max_age(rig.stage_rate_hz(), 500ms);
  limits.wrench_longest_frozen = from_seconds(rig.frozen_wrench_s);
  limits.taxels_longest_frozen = from_seconds(rig.frozen_taxels_s);
  limits.wrench_jump_n = jump_share * rig.force_cap_n;
  limits.cycle_max_lateness = 250ms;
  limits.least_free_bytes = least_free_bytes;
  return limits;
}

recipes::WatchLimits watch_limits(const recipes::RigLimits& rig) {
  recipes::WatchLimits limits;
  limits.wrench_jump_n = jump_share * rig.force_cap_n;
  limits.wrench_gap = from_seconds(jump_gap_readings / rig.wrench_rate_hz);
  for (const StageAxis axis : recipes::all_axes) {
    const bool linear = recipes::is_linear(axis);
    limits.max_speed[recipes::index(axis)] = linear ? rig.max_speed_mps : rig.max_tilt_speed_radps;
    limits.max_acceleration[recipes::index(axis)] =
        linear ? rig.max_acceleration_mps2 : rig.max_tilt_speed_radps / tilt_ramp_s;
  }
  return limits;
}

}  // namespace

Supervisor::Supervisor(const recipes::Plan& plan, Loop& loop, Bench& bench,
                       TrialRecording& recording, SupervisorHooks hooks)
    : plan_(&plan),
      loop_(&loop),
      bench_(&bench),
      recording_(&recording),
      hooks_(std::move(hooks)),
      guard_limits_(guard_limits(plan.limits)),
      watch_(watch_limits(plan.limits)),
      period_(from_seconds(1.0 / plan.limits.cycle_hz)) {
  force_config_.cycle_s = 1.0 / plan.limits.cycle_hz;
  force_config_.max_acceleration_mps2 = plan.limits.max_acceleration_mps2;
  bench_->on_sensor_sample([this](const Sample& sample) { recording_->sensor(sample); });
}

Supervisor::~Supervisor() {
  bench_->on_sensor_sample({});
  loop_->cancel(cycle_timer_);
  loop_->cancel(engine_timer_);
}

void Supervisor::start(std::size_t first_trial) {
  last_cycle_ = loop_->now();
  cycle_due_ = last_cycle_ + period_;
  cycle_timer_ = loop_->at(cycle_due_, [this] { cycle(); });
  dispatch(recipes::Start{first_trial});
}

void Supervisor::request(recipes::Event event) {
  dispatch(std::move(event));
}

// Events that effects cause wait in line, so that the engine never runs inside itself.
void Supervisor::dispatch(recipes::Event event) {
  events_.push_back(std::move(event));
  if (std::exchange(dispatching_, true)) return;
  while (!events_.empty()) {
    const recipes::Event next = std::move(events_.front());
    events_.pop_front();
    recipes::Transition transition = recipes::step(*plan_, state_, next, loop_->now());
    state_ = std::move(transition.next);
    for (const recipes::Effect& effect : transition.effects)
      std::visit([this](const auto& e) { carry_out(e); }, effect);
  }
  dispatching_ = false;
}

std::uint32_t Supervisor::command(StageAxis axis, const Command& command) {
  const Result<std::uint32_t> id = bench_->stage(axis).driver().command(command);
  if (id) return *id;
  dispatch(recipes::Fault{Error(id.error()).in(bench_->stage(axis).entry().name)});
  return 0;
}

void Supervisor::drive(StageAxis axis, double velocity) {
  command(axis, ServoCommand{velocity, servo_horizon});
  watch_.driven(axis, velocity, servo_horizon, loop_->now());
}

void Supervisor::stand_still(StageAxis axis) {
  watch_.released(axis);
  Driver& driver = bench_->stage(axis).driver();
  if (!driver.command(ServoCommand{0, servo_horizon})) driver.stop();
}

void Supervisor::carry_out(const recipes::TrialBegin& effect) {
  recording_->begin(effect.trial, loop_->now());
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
  descent_.reset();
  motion_ = Motion{effect.ticket, {}};
  for (const recipes::AxisMove& move : effect.moves) {
    motion_->moves.push_back({move.axis, command(move.axis, MoveCommand{move.target, move.speed})});
    const double from = bench_->snapshot().stage[recipes::index(move.axis)].position;
    watch_.moved(move.axis, from, move.target, move.speed, loop_->now());
  }
}

void Supervisor::carry_out(const recipes::BiasSensors& effect) {
  const Result<std::uint32_t> sent = bench_->wrench().driver().command(BiasCommand{});
  if (!sent) return dispatch(recipes::Fault{Error(sent.error()).in("wrench")});
  bench_->take_zero({});
  biasing_ = Biasing{effect.ticket, loop_->now(), 0, {}, {}};
}

void Supervisor::carry_out(const recipes::Descend& effect) {
  motion_.reset();
  descent_ = effect;
}

void Supervisor::carry_out(const recipes::HoldForce& effect) {
  descent_.reset();
  const recipes::SettleDetector settle{effect.band_n, effect.dwell_s};
  regulation_ = Regulation{effect, {}, settle};
}

void Supervisor::carry_out(const recipes::ReleaseForce&) {
  if (!std::exchange(regulation_, {})) return;
  stand_still(StageAxis::z);
}

void Supervisor::carry_out(const recipes::SetPhase& effect) {
  recording_->set_phase(effect.phase);
}

void Supervisor::carry_out(const recipes::ArmTimer& effect) {
  loop_->cancel(engine_timer_);
  deadline_ = effect.deadline;
  engine_timer_ = loop_->at(
      effect.deadline, [this, ticket = effect.ticket] { dispatch(recipes::TimerExpired{ticket}); });
}

void Supervisor::carry_out(const recipes::StopMotion&) {
  motion_.reset();
  descent_.reset();
  biasing_.reset();
  regulation_.reset();
  for (const StageAxis axis : recipes::all_axes) stand_still(axis);
}

void Supervisor::carry_out(const recipes::TrialDone& effect) {
  recording_->end(effect.outcome, loop_->now());
  if (hooks_.trial_done) hooks_.trial_done(effect, recording_->trial_force());
}

void Supervisor::carry_out(const recipes::CampaignDone& effect) {
  loop_->cancel(cycle_timer_);
  loop_->cancel(engine_timer_);
  result_ = effect;
}

}  // namespace weft::daemon
