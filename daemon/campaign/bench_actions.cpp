#include "daemon/campaign/bench_actions.hpp"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "recipes/control/servo.hpp"

namespace weft::daemon {
namespace {

using namespace std::chrono_literals;

// The guard catches a timer of the machine that did not fire. A late loop runs this cycle first.
// The timer, perhaps the regular end of a phase, runs right after.
constexpr Duration deadline_grace = 100ms;
// The sensor has taken its bias when readings stay this close to zero for this time and number. The
// tolerance is ten counts of a Mini40 SI-40-2 (docs/reference/device-facts.md, Mini40). The mean of
// these readings is the zero. The sensor's own bias is one noisy reading, sometimes 20 mN off.
constexpr double bias_tolerance_n = 0.2;
constexpr Duration bias_time = 1s;
constexpr std::uint64_t bias_readings = 50;
// Taxel frames in a baseline.
constexpr std::size_t baseline_frames = 5;
// A request over UDP may be lost, and it has no answer. It is repeated while readings are off.
constexpr Duration bias_again = 1s;
// Share of the force cap. A larger step between two readings is no real force: the mount, at its
// stiffest and fastest, makes a tenth of it. Level L0 of the plant steps to its set point at once.
constexpr double jump_share = 0.4;
// A landing or a lift-off changes the load by the probe's weight; the rest is noise.
constexpr double landing_share = 1.2;
// Readings further apart than this (in periods) are not compared.
constexpr double jump_gap_readings = 5;
// A stage that was commanded to stop still moves for up to this time.
constexpr Duration z_comes_to_rest = 250ms;
// A rotary stage reaches its speed within this time [s].
constexpr double tilt_ramp_s = 1;
// Some ten thousand trials of samples, or the write-ahead log of a reader that holds it back.
constexpr std::uint64_t least_free_bytes = std::uint64_t{64} << 20;

Duration max_age(double rate_hz, double least_s) {
  return from_seconds(recipes::most_age_s(rate_hz, least_s));
}

/// Nothing if an array has not sent a frame yet.
std::optional<TimePoint> oldest(std::span<const recipes::TaxelReading> arrays) {
  const auto first = std::ranges::min_element(arrays, {}, &recipes::TaxelReading::at);
  return first == arrays.end() ? std::nullopt : first->at;
}

recipes::GuardLimits guard_limits(const recipes::RigLimits& rig) {
  recipes::GuardLimits limits;
  limits.force_cap_n = rig.force_cap_n;
  limits.torque_cap_nm = rig.torque_cap_nm;
  limits.travel = rig.geometry.travel;
  limits.fixed = rig.geometry.fixed;
  if (rig.has_wrench) limits.wrench_max_age = max_age(rig.wrench_rate_hz, 0.1);
  limits.taxel_cap_counts = rig.taxel_cap_counts;
  if (rig.taxels > 0) limits.taxels_max_age = from_seconds(rig.most_taxel_age_s());
  limits.stage_max_age = max_age(rig.stage_rate_hz(), 0.5);
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
  limits.landing_n = landing_share * rig.probe_weight_n;
  if (rig.has_wrench) limits.wrench_gap = from_seconds(jump_gap_readings / rig.wrench_rate_hz);
  limits.order_age = recipes::order_age(rig.cycle_hz);
  for (const StageAxis axis : recipes::all_axes) {
    const bool linear = recipes::is_linear(axis);
    limits.max_speed[recipes::index(axis)] = linear ? rig.max_speed_mps : rig.max_tilt_speed_radps;
    limits.max_acceleration[recipes::index(axis)] =
        linear ? rig.max_acceleration_mps2 : rig.max_tilt_speed_radps / tilt_ramp_s;
  }
  return limits;
}

}  // namespace

BenchActions::BenchActions(const recipes::RigLimits& limits, Loop& loop, Bench& bench,
                           EventSink on_event)
    : loop_(&loop),
      bench_(&bench),
      on_event_(std::move(on_event)),
      period_(from_seconds(1.0 / limits.cycle_hz)),
      guard_limits_(guard_limits(limits)),
      watch_(watch_limits(limits)),
      touch_counts_(limits.touch_counts) {}

std::uint32_t BenchActions::command(StageAxis axis, const Command& command) {
  const Result<std::uint32_t> id = bench_->stage(axis).driver().command(command);
  if (id) return *id;
  on_event_(recipes::Fault{Error(id.error()).in(bench_->stage(axis).entry().name)});
  return 0;
}

void BenchActions::drive(StageAxis axis, double velocity) {
  command(axis, ServoCommand{velocity, recipes::servo_horizon});
  watch_.driven(axis, velocity, recipes::servo_horizon, loop_->now());
}

void BenchActions::set_still(StageAxis axis) {
  watch_.released(axis, loop_->now());
  Driver& driver = bench_->stage(axis).driver();
  if (!driver.command(ServoCommand{0, recipes::servo_horizon})) driver.stop();
}

void BenchActions::begin(const recipes::MoveTo& order) {
  force_way_.reset();
  motion_ = Motion{order.ticket, {}, ZWay::none};
  for (const recipes::AxisMove& move : order.moves) {
    const MoveCommand sent{move.target, move.speed, move.unhomed};
    motion_->moves.push_back({move.axis, command(move.axis, sent)});
    const double from = bench_->snapshot().stage[recipes::index(move.axis)].position;
    watch_.moved(move.axis, from, move.target, move.speed, loop_->now());
    if (move.axis == StageAxis::z) motion_->z_way = z_way(from, move.target);
  }
}

void BenchActions::begin(const recipes::BiasSensors& order) {
  bench_->set_zero({});
  biasing_ = Biasing{.ticket = order.ticket};
  if (bench_->has_wrench()) return send_bias();
  biasing_->sent_at = loop_->now();
  bench_->touch().begin();
}

void BenchActions::send_bias() {
  Device& sensor = bench_->wrench();
  biasing_->sent_at = loop_->now();
  ++biasing_->times;
  if (const auto sent = sensor.driver().command(BiasCommand{}); !sent)
    on_event_(recipes::Fault{Error(sent.error()).in(sensor.entry().name)});
}

void BenchActions::begin(const recipes::Ascend& order) {
  begin(ForceWay{{order.ticket, order.target_z_m, order.speed_mps, order.stop_force_n}, true});
}

void BenchActions::begin(const ForceWay& way) {
  motion_.reset();
  force_way_ = way;
}

void BenchActions::stop() {
  motion_.reset();
  force_way_.reset();
  biasing_.reset();
  for (const StageAxis axis : recipes::all_axes)
    if (bench_->has_stage(axis)) set_still(axis);
}

void BenchActions::check_all() {
  check_motion();
  check_force_way();
  check_bias();
}

void BenchActions::check_motion() {
  if (!motion_) return;
  const Snapshot& seen = bench_->snapshot();
  const auto lost = [this](const Awaited& awaited) {
    return awaited.move_id == 0 || bench_->stage(awaited.axis).fault_seen().has_value();
  };
  if (std::any_of(motion_->moves.begin(), motion_->moves.end(), lost))
    return on_event_(recipes::MotionLost{std::exchange(motion_, {})->ticket});
  const bool all_there =
      std::all_of(motion_->moves.begin(), motion_->moves.end(), [&](const Awaited& awaited) {
        return seen.stage[recipes::index(awaited.axis)].move_id == awaited.move_id;
      });
  if (!all_there) return;
  const recipes::Ticket ticket = motion_->ticket;
  for (const Awaited& awaited : motion_->moves) watch_.released(awaited.axis, loop_->now());
  motion_.reset();
  on_event_(recipes::MotionDone{ticket});
}

// The motion is a velocity that expires by itself and is sent again in each cycle. If the host dies
// during it, the stage must not continue into the plate (docs/adr/0002).
void BenchActions::check_force_way() {
  if (!force_way_) return;
  const Snapshot& seen = bench_->snapshot();
  const double z_m = seen.stage[recipes::index(StageAxis::z)].position;
  const double force_n = seen.wrench.force_n[2];
  const auto [order, up] = *force_way_;
  const bool reached = !bench_->has_wrench() ? !up && is_touched()
                       : up                  ? force_n <= order.stop_force_n
                                             : force_n >= order.stop_force_n;
  const bool is_there = up ? z_m <= order.target_z_m : z_m >= order.target_z_m;
  if (!reached && !is_there) return drive(StageAxis::z, up ? -order.speed_mps : order.speed_mps);
  force_way_.reset();
  set_still(StageAxis::z);
  if (!up) touched_z_m_ = z_m;
  if (reached)
    on_event_(recipes::ForceReached{order.ticket, z_m});
  else
    on_event_(recipes::MotionDone{order.ticket});
}

// Checks the mean of a cycle: it shows a bad reading even if good ones follow.
void BenchActions::check_bias() {
  if (!biasing_) return;
  if (!bench_->has_wrench()) return check_baseline();
  const Snapshot& seen = bench_->snapshot();
  if (seen.wrench_recent.readings == 0 || *seen.wrench_at <= biasing_->sent_at) return;
  const std::array<double, 3> mean_n = seen.wrench_recent.mean().force_n;
  const bool quiet = std::all_of(mean_n.begin(), mean_n.end(),
                                 [](double f) { return std::abs(f) <= bias_tolerance_n; });
  if (!quiet) {
    biasing_->quiet_since.reset();
    biasing_->quiet = {};
    biasing_->off_n = mean_n;
    if (loop_->now() - biasing_->sent_at >= bias_again) send_bias();
    return;
  }
  if (!biasing_->quiet_since) biasing_->quiet_since = seen.wrench_at;
  biasing_->quiet.add(seen.wrench_recent);
  if (biasing_->quiet.readings < bias_readings ||
      *seen.wrench_at - *biasing_->quiet_since < bias_time)
    return;
  bench_->set_zero(biasing_->quiet.mean());
  const recipes::Ticket ticket = biasing_->ticket;
  biasing_.reset();
  on_event_(recipes::Biased{ticket});
}

bool BenchActions::is_touched() const {
  return bench_->touch().mean_change() >= touch_counts_;
}

// Counts that drift by half the touch threshold could look like a touch.
void BenchActions::check_baseline() {
  recipes::TaxelTouch& touch = bench_->touch();
  if (touch.baseline_spread() > touch_counts_ / 2) {
    touch.begin();
    biasing_->sent_at = loop_->now();
    ++biasing_->times;
  }
  if (touch.baseline_frames() < baseline_frames || loop_->now() - biasing_->sent_at < bias_time)
    return;
  touch.settle();
  const recipes::Ticket ticket = std::exchange(biasing_, {})->ticket;
  on_event_(recipes::Biased{ticket});
}

Error BenchActions::no_baseline() const {
  return {.code = Errc::timeout,
          .where = "taxels",
          .what = "taxel counts not constant while the probe is free",
          .expected = "a mean within " + std::to_string(touch_counts_ / 2) + " counts for " +
                      std::to_string(to_seconds(bias_time)) + " s",
          .got = biasing_->times == 0 ? "too few frames"
                                      : std::to_string(biasing_->times) + " attempts",
          .hint = "Remove what touches the probe, or increase probe.touch_counts"};
}

std::optional<Error> BenchActions::still_awaited() const {
  if (!biasing_) return std::nullopt;
  if (!bench_->has_wrench()) return no_baseline();
  char wanted[96], got[160] = "too few readings";
  std::snprintf(wanted, sizeof wanted, "each component of the force within %.1f N for %.0f s",
                bias_tolerance_n, to_seconds(bias_time));
  if (const auto& off_n = biasing_->off_n)
    std::snprintf(got, sizeof got, "%.2f, %.2f, %.2f N along x, y, z, after %d requests",
                  (*off_n)[0], (*off_n)[1], (*off_n)[2], biasing_->times);
  return Error{
      .code = Errc::timeout,
      .where = bench_->wrench().entry().name,
      .what = "force not zero after the bias",
      .expected = wanted,
      .got = got,
      .hint = "Check what touches or shakes the plate, then the cable or network of the sensor"};
}

// Between set point and rest, z stays at or below the height where the fabric first carried the
// probe.
BenchActions::ZWay BenchActions::z_way(double from, double target) const {
  if (target > from) return ZWay::down;
  return touched_z_m_ && target >= *touched_z_m_ ? ZWay::none : ZWay::off_the_cloth;
}

// Under the force loop, z follows the measured force and the probe stays on the fabric. After a
// command to stop or to reverse, z continues for a moment: then both landing and lift-off are
// possible.
void BenchActions::check_z_motion(recipes::WatchInput& watched, TimePoint now) {
  const ZWay way = motion_ ? motion_->z_way : ZWay::none;
  if (way == ZWay::down || (force_way_ && !force_way_->up)) can_land_until_ = now + z_comes_to_rest;
  if (way == ZWay::off_the_cloth) can_lift_until_ = now + z_comes_to_rest;
  watched.can_land = now <= can_land_until_;
  watched.can_lift = now <= can_lift_until_;
}

std::optional<recipes::GuardTrip> BenchActions::check_guards(const GuardContext& context) {
  const Snapshot& seen = bench_->snapshot();
  const TimePoint now = loop_->now();
  recipes::GuardReadings readings;
  readings.force_n = seen.wrench.force_n;
  readings.torque_nm = seen.wrench.torque_nm;
  readings.wrench_valid = seen.wrench.valid;
  readings.wrench_at = seen.wrench_at;
  readings.taxels_at = oldest(seen.taxels);
  readings.taxel_change = bench_->touch().largest_change();
  readings.position = seen.joints();
  readings.stage_at = seen.stage_at;
  if (context.deadline) readings.deadline = *context.deadline + deadline_grace;
  readings.cycle_lateness = context.since_last - period_;
  readings.free_bytes = context.free_bytes;
  recipes::WatchInput watched = newest();
  watched.zero_moves = context.zero_moves;
  check_z_motion(watched, now);
  readings.history = watch_.step(watched, now);
  return recipes::evaluate(guard_limits_, readings, now);
}

recipes::WatchInput BenchActions::newest() const {
  const Snapshot& seen = bench_->snapshot();
  recipes::WatchInput input;
  input.force_n = seen.wrench.force_n;
  input.torque_nm = seen.wrench.torque_nm;
  input.wrench_at = seen.wrench_at;
  input.taxels = seen.taxels;
  input.position = seen.joints();
  input.stage_at = seen.stage_at;
  return input;
}

void BenchActions::poll(std::uint64_t cycle) {
  bench_->begin_recent();
  constexpr std::uint64_t slow_divisor = recipes::RigLimits::cycles_per_stage_row;
  command(StageAxis::z, PollCommand{});
  if (cycle % slow_divisor != slow_divisor - 1) return;
  for (const StageAxis axis : {StageAxis::x, StageAxis::y, StageAxis::rx, StageAxis::ry})
    if (bench_->has_stage(axis)) command(axis, PollCommand{});
}

}  // namespace weft::daemon
