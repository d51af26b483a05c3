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
// a Mini40 SI-40-2 (protocols.md B.6).
constexpr double bias_tolerance_n = 0.2;
constexpr unsigned bias_readings = 10;

}  // namespace

void Supervisor::cycle() {
  const TimePoint now = loop_->now();
  const Duration since_last = now - std::exchange(last_cycle_, now);
  ++cycles_;
  if (const Error* error = bench_->fault()) dispatch(recipes::Fault{*error});
  if (recording_->error()) dispatch(recipes::Fault{*recording_->error()});
  if (const auto trip = look_at_guards()) dispatch(recipes::GuardTripped{*trip});
  look_at_motion();
  look_at_descent();
  look_at_bias();
  regulate(since_last);
  if (cycles_ % slow_divisor == 0) recording_->stages(bench_->snapshot(), now);
  poll();
  recording_->commit_if_due();
  if (!result_) cycle_timer_ = loop_->at(now + period_, [this] { cycle(); });
}

std::optional<recipes::GuardTrip> Supervisor::look_at_guards() const {
  const Snapshot& seen = bench_->snapshot();
  recipes::GuardReadings readings;
  readings.force_n = seen.wrench.force_n;
  readings.torque_nm = seen.wrench.torque_nm;
  readings.wrench_valid = seen.wrench.valid;
  readings.wrench_at = seen.wrench_at;
  readings.taxels_at = seen.taxels_at;
  readings.position = seen.joints();
  readings.stage_at = seen.stage_at;
  if (deadline_) readings.deadline = *deadline_ + deadline_grace;
  return recipes::evaluate(guard_limits_, readings, loop_->now());
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
  motion_.reset();
  dispatch(recipes::MotionDone{ticket});
}

void Supervisor::look_at_descent() {
  if (!descent_) return;
  const Snapshot& seen = bench_->snapshot();
  const StageSample& z = seen.stage[recipes::index(StageAxis::z)];
  const recipes::Ticket ticket = descent_->order.ticket;
  if (seen.wrench.force_n[2] >= descent_->order.stop_force_n) {
    descent_.reset();
    stand_still(StageAxis::z);
    dispatch(recipes::ContactFound{ticket, z.position});
  } else if (z.move_id == descent_->move_id) {
    descent_.reset();
    dispatch(recipes::MotionDone{ticket});
  }
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
  biasing_->quiet_readings = quiet ? biasing_->quiet_readings + 1 : 0;
  if (biasing_->quiet_readings < bias_readings) return;
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
  command(StageAxis::z, ServoCommand{wanted.velocity_mps, servo_horizon()});
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
