// The scan cycle of the supervisor: read, guard, look for what is awaited, regulate, poll.

#include <algorithm>

#include "daemon/run/supervisor.hpp"

namespace weft::daemon {
namespace {

using namespace std::chrono_literals;

// Stages other than z are read, and all are recorded, once in this many cycles.
constexpr std::uint64_t slow_divisor = recipes::RigLimits::cycles_per_stage_row;
// The guard is for an engine's timer that did not come. A late loop runs this cycle first and the
// timer, which may be the regular end of a phase, right after.
constexpr Duration deadline_grace = 100ms;
// Readings this close to zero, this many in a row, show that the bias was taken; ten counts of
// a Mini40 SI-40-2 (protocols.md B.6). Their mean is the zero: the sensor's own is one reading with
// its noise, 20 mN off now and then.
constexpr double bias_tolerance_n = 0.2;
constexpr unsigned bias_readings = 50;

}  // namespace

void Supervisor::cycle() {
  const TimePoint now = loop_->now();
  const Duration since_last = now - std::exchange(last_cycle_, now);
  ++cycles_;
  if (guarded(since_last)) {
    look_at_motion();
    look_at_descent();
    look_at_bias();
    regulate(since_last);
  }
  if (cycles_ % slow_divisor == 0) recording_->stages(bench_->snapshot(), now);
  poll();
  recording_->commit_if_due();
  // From when it was due, not from when it came: lateness does not slow the rate. What was missed
  // is not made up for.
  cycle_due_ = std::max(cycle_due_ + period_, now);
  if (!result_) cycle_timer_ = loop_->at(cycle_due_, [this] { cycle(); });
}

// Whether this cycle may command. After a fault or a trip the engine's own answer (stop, retreat)
// is all that goes out in it; a retreat that is under way already goes on to its end.
bool Supervisor::guarded(Duration since_last) {
  const bool retreating = state_.step == recipes::Step::retracting;
  const std::size_t events = trips_;
  if (const Error* error = bench_->fault()) trip(recipes::Fault{*error});
  if (recording_->error()) trip(recipes::Fault{*recording_->error()});
  if (const auto guard = look_at_guards(since_last)) {
    const bool at_leisure = guard->action == recipes::GuardAction::finish_trial;
    if (at_leisure)
      dispatch(recipes::GuardTripped{*guard});
    else
      trip(recipes::GuardTripped{*guard});
  }
  if (trips_ == events) return true;
  if (retreating) look_at_motion();
  return false;
}

void Supervisor::trip(recipes::Event event) {
  ++trips_;
  dispatch(std::move(event));
}

std::optional<recipes::GuardTrip> Supervisor::look_at_guards(Duration since_last) {
  const Snapshot& seen = bench_->snapshot();
  const TimePoint now = loop_->now();
  recipes::GuardReadings readings;
  readings.force_n = seen.wrench.force_n;
  readings.torque_nm = seen.wrench.torque_nm;
  readings.wrench_valid = seen.wrench.valid;
  readings.wrench_at = seen.wrench_at;
  readings.taxels_at = seen.taxels_at;
  readings.position = seen.joints();
  readings.stage_at = seen.stage_at;
  if (deadline_) readings.deadline = *deadline_ + deadline_grace;
  readings.cycle_lateness = since_last - period_;
  readings.free_bytes = recording_->free_bytes();
  readings.history = watch_.step(watched(seen), now);
  return recipes::evaluate(guard_limits_, readings, now);
}

recipes::WatchInput Supervisor::watched(const Snapshot& seen) const {
  recipes::WatchInput input;
  input.force_n = seen.wrench.force_n;
  input.torque_nm = seen.wrench.torque_nm;
  input.wrench_at = seen.wrench_at;
  input.taxel_digest = seen.taxel_digest;
  input.taxels_at = seen.taxels_at;
  input.position = seen.joints();
  input.stage_at = seen.stage_at;
  // Whoever changes the cloth touches the plate, and a bias moves the zero.
  input.zero_moves = state_.step < recipes::Step::approaching;
  return input;
}

void Supervisor::look_at_motion() {
  if (!motion_) return;
  const Snapshot& seen = bench_->snapshot();
  const bool all_there =
      std::all_of(motion_->moves.begin(), motion_->moves.end(), [&](const Awaited& awaited) {
        return seen.stage[recipes::index(awaited.axis)].move_id == awaited.move_id;
      });
  if (!all_there) return;
  const recipes::Ticket ticket = motion_->ticket;
  for (const Awaited& awaited : motion_->moves) watch_.released(awaited.axis);
  motion_.reset();
  dispatch(recipes::MotionDone{ticket});
}

// The way down is a velocity that ends by itself, sent again in each cycle: a host that dies on the
// way must not leave a stage that goes on into the plate (docs/adr/0002).
void Supervisor::look_at_descent() {
  if (!descent_) return;
  const Snapshot& seen = bench_->snapshot();
  const StageSample& z = seen.stage[recipes::index(StageAxis::z)];
  const recipes::Ticket ticket = descent_->ticket;
  const bool touched = seen.wrench.force_n[2] >= descent_->stop_force_n;
  if (!touched && z.position < descent_->target_z_m)
    return drive(StageAxis::z, descent_->speed_mps);
  descent_.reset();
  stand_still(StageAxis::z);
  if (touched)
    dispatch(recipes::ContactFound{ticket, z.position});
  else
    dispatch(recipes::MotionDone{ticket});
}

void Supervisor::look_at_bias() {
  if (!biasing_) return;
  const Snapshot& seen = bench_->snapshot();
  if (!seen.wrench_at || *seen.wrench_at <= biasing_->since ||
      seen.wrench_at == biasing_->last_reading)
    return;
  biasing_->last_reading = seen.wrench_at;
  const bool quiet = std::all_of(seen.wrench.force_n.begin(), seen.wrench.force_n.end(),
                                 [](double f) { return std::abs(f) <= bias_tolerance_n; });
  if (!quiet) {
    biasing_->quiet_readings = 0;
    biasing_->sum = {};
    return;
  }
  for (std::size_t i = 0; i < 3; ++i) {
    biasing_->sum.force_n[i] += seen.wrench.force_n[i] / bias_readings;
    biasing_->sum.torque_nm[i] += seen.wrench.torque_nm[i] / bias_readings;
  }
  if (++biasing_->quiet_readings < bias_readings) return;
  bench_->take_zero(biasing_->sum);
  const recipes::Ticket ticket = biasing_->ticket;
  biasing_.reset();
  dispatch(recipes::Biased{ticket});
}

void Supervisor::regulate(Duration since_last) {
  if (!regulation_) return;
  const Snapshot& seen = bench_->snapshot();
  const double force_n = seen.wrench.force_n[2];
  const double dt_s = to_seconds(since_last);
  recipes::ForceLoopInput input;
  input.setpoint_n = regulation_->order.force_n;
  input.force_n = force_n;
  input.z_m = seen.stage[recipes::index(StageAxis::z)].position;
  input.dt_s = dt_s;
  input.learn_stiffness = state_.step != recipes::Step::sliding;
  const recipes::ForceCommand wanted = recipes::step(force_config_, regulation_->loop, input);
  drive(StageAxis::z, wanted.velocity_mps);
  if (!regulation_ || regulation_->settled) return;
  if (!regulation_->settle.step(force_n - regulation_->order.force_n, dt_s)) return;
  regulation_->settled = true;
  dispatch(recipes::ForceSettled{regulation_->order.ticket});
}

void Supervisor::poll() {
  command(StageAxis::z, PollCommand{});
  if (cycles_ % slow_divisor != slow_divisor - 1) return;
  for (const StageAxis axis : {StageAxis::x, StageAxis::y, StageAxis::rx, StageAxis::ry})
    command(axis, PollCommand{});
}

}  // namespace weft::daemon
