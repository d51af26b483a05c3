#include "recipes/control/guards.hpp"

#include <cmath>
#include <string>

namespace weft::recipes {
namespace {

using Trip = std::optional<GuardTrip>;

constexpr std::array<GuardRule, guard_count> rules{{
    {Guard::invalid_wrench, "invalid_wrench", GuardAction::end_campaign,
     "the status word of the sensor marks its values as invalid, or a value exceeds the rating of "
     "the sensor"},
    {Guard::force_cap, "force_cap", GuardAction::fail_trial,
     "the magnitude of the force exceeds limits.force_cap_N or is not a number; before the bias is "
     "set, the weight of the mounted parts counts too"},
    {Guard::torque_cap, "torque_cap", GuardAction::fail_trial,
     "the magnitude of the torque exceeds limits.torque_cap_Nm or is not a number; before the bias "
     "is set, the weight of the mounted parts counts too"},
    {Guard::taxel_cap, "taxel_cap", GuardAction::fail_trial,
     "on a rig without a force sensor: a taxel differs from its value before contact by more than "
     "limits.taxel_cap_counts, or reads 65535"},
    {Guard::frozen_wrench, "frozen_wrench", GuardAction::end_campaign,
     "all six components keep exactly the same values for limits.frozen_wrench_s (0.25 s); a "
     "working sensor has noise"},
    {Guard::wrench_jump, "wrench_jump", GuardAction::hold,
     "a reading differs from the last accepted one by 0.4 x the force cap; exception: a load of up "
     "to 1.2 x the probe's weight that appears while z moves down, or disappears while z moves up, "
     "and until 0.25 s later; the third in a row fails the trial"},
    {Guard::travel, "travel", GuardAction::end_campaign,
     "a stage reports a position outside limits.travel_mm or limits.tilt_deg"},
    {Guard::stage_speed, "stage_speed", GuardAction::end_campaign,
     "positions of a stage are further apart than 1.1 x its top speed plus 0.25 s at that speed "
     "allows"},
    {Guard::following_error, "following_error", GuardAction::end_campaign,
     "a stage lags its command by 0.3 s of its speed, two ramps and 0.2 mm; under velocity "
     "control: its deviation from ramps, the 100 ms of a velocity and the age of readings exceeds "
     "20 um plus 0.3 s of its speed (0.075 s of the earlier speed after a stop command)"},
    {Guard::stale_wrench, "stale_wrench", GuardAction::end_campaign,
     "no wrench for ten of its periods and 0.1 s"},
    {Guard::stale_stage, "stale_stage", GuardAction::end_campaign,
     "no position of a stage for ten of its periods and 0.5 s"},
    {Guard::stale_taxels, "stale_taxels", GuardAction::end_campaign,
     "no frame for ten of its periods and 0.5 s"},
    {Guard::frozen_taxels, "frozen_taxels", GuardAction::end_campaign,
     "all counts of an array are the same for limits.frozen_taxels_s (1)"},
    {Guard::late_cycle, "late_cycle", GuardAction::fail_trial,
     "a scan cycle starts more than 0.25 s late"},
    {Guard::deadline, "deadline", GuardAction::fail_trial,
     "a step of the engine did not end before its deadline, and its timer did not fire"},
    {Guard::disk, "disk", GuardAction::finish_trial,
     "the file system of the recording has less than 64 MiB left"},
}};

GuardTrip trip(Guard guard, std::string message, std::string where, std::string expected,
               std::string got, std::string hint = {}) {
  return {guard, rules[static_cast<std::size_t>(guard)].action,
          Error{.code = Errc::safety,
                .where = std::move(where),
                .what = std::move(message),
                .expected = std::move(expected),
                .got = std::move(got),
                .hint = std::move(hint)}};
}

/// Deviating readings in a row after which the bench, not the wire, is assumed to be the cause.
constexpr unsigned jumps_that_fail = 3;

std::string stage(Axis axis) {
  return "stage " + std::string(to_string(axis));
}

std::string seconds(Duration duration) {
  return std::to_string(to_seconds(duration)) + " s";
}

double magnitude(const std::array<double, 3>& v) {
  return std::hypot(v[0], v[1], v[2]);
}

/// True also for NaN: a reading that cannot be compared is not a safe one.
bool over(double value, double cap) {
  return !(value <= cap);
}

// The value of a saturated or broken sensor is not a force: it is not compared with a cap.
Trip check_wrench(const GuardLimits& limits, const GuardReadings& readings) {
  const double force = magnitude(readings.force_n);
  if (!readings.wrench_valid)
    return trip(Guard::invalid_wrench, "force/torque readings invalid", "wrench",
                "no error bit, and values within the rating",
                "an error bit or values beyond the rating, at " + std::to_string(force) + " N",
                "Check the load on the sensor, then its status and cable");
  if (over(force, limits.force_cap_n))
    return trip(Guard::force_cap, "force above the cap", "wrench",
                "at most " + std::to_string(limits.force_cap_n) + " N",
                std::to_string(force) + " N", "Check the fabric and the mount of the probe");
  if (const double torque = magnitude(readings.torque_nm); over(torque, limits.torque_cap_nm))
    return trip(Guard::torque_cap, "torque above the cap", "wrench",
                "at most " + std::to_string(limits.torque_cap_nm) + " N m",
                std::to_string(torque) + " N m", "Check whether the probe is caught in the fabric");
  return {};
}

Trip check_taxels(const GuardLimits& limits, const GuardReadings& readings) {
  if (limits.taxel_cap_counts <= 0 || !over(readings.taxel_change, limits.taxel_cap_counts))
    return {};
  return trip(Guard::taxel_cap, "change of a taxel above the cap", "taxels",
              "at most " + std::to_string(limits.taxel_cap_counts) + " counts",
              std::to_string(readings.taxel_change) + " counts",
              "Check the fabric and the mount of the probe, or reduce the press depth");
}

Trip check_travel(const GuardLimits& limits, const GuardReadings& readings) {
  for (const Axis axis : all_axes) {
    const Range& range = limits.travel[index(axis)];
    const double position = readings.position[axis];
    if (position >= range.min - limits.travel_slack && position <= range.max + limits.travel_slack)
      continue;
    const std::string unit = is_linear(axis) ? " m" : " rad";
    return trip(Guard::travel, "stage outside its travel", "stage " + std::string(to_string(axis)),
                std::to_string(range.min) + " to " + std::to_string(range.max) + unit,
                std::to_string(position) + unit, "Home the stage again");
  }
  return {};
}

/// Runs every cycle for every stream, so text is built only after a limit is exceeded.
Trip check_age(Guard guard, std::string_view device, const std::optional<TimePoint>& at,
               Duration max_age, TimePoint now) {
  if (at && now - *at <= max_age) return {};
  const std::string got =
      at ? std::to_string(to_seconds(now - *at)) + " s old" : std::string("no reading yet");
  const std::string where = (guard == Guard::stale_stage ? "stage " : "") + std::string(device);
  return trip(guard, "readings stopped", where,
              "a reading at most " + std::to_string(to_seconds(max_age)) + " s old", got,
              "Check the device's cable and power");
}

Trip check_ages(const GuardLimits& limits, const GuardReadings& readings, TimePoint now) {
  if (limits.wrench_max_age > Duration::zero())
    if (Trip t = check_age(Guard::stale_wrench, "wrench", readings.wrench_at, limits.wrench_max_age,
                           now))
      return t;
  for (const Axis axis : all_axes) {
    if (limits.fixed[index(axis)]) continue;
    if (Trip t = check_age(Guard::stale_stage, to_string(axis), readings.stage_at[index(axis)],
                           limits.stage_max_age, now))
      return t;
  }
  if (limits.taxels_max_age <= Duration::zero()) return {};
  return check_age(Guard::stale_taxels, "taxels", readings.taxels_at, limits.taxels_max_age, now);
}

Trip check_deadline(const GuardReadings& readings, TimePoint now) {
  if (!readings.deadline || now <= *readings.deadline) return {};
  return trip(
      Guard::deadline, "step missed its deadline", "engine",
      "an end before " + std::to_string(to_seconds(*readings.deadline)) + " s of bench time",
      std::to_string(to_seconds(now)) + " s");
}

Trip check_frozen(Guard guard, const char* device, Duration frozen, Duration longest) {
  if (longest <= Duration::zero() || frozen < longest) return {};
  return trip(guard, "readings frozen", device, "a change within " + seconds(longest),
              "the same values for " + seconds(frozen), "Switch the device off and on again");
}

Trip check_jump(const GuardLimits& limits, const GuardReadings& readings) {
  const GuardHistory& seen = readings.history;
  if (seen.wrench_jumps > 0) {
    GuardTrip t = trip(Guard::wrench_jump, "force jumped", "wrench",
                       "within " + std::to_string(limits.wrench_jump_n) + " N of the last reading",
                       std::to_string(seen.wrench_jump_n) + " N away",
                       "Check the cable of the sensor and remove objects that touch the plate");
    if (seen.wrench_jumps >= jumps_that_fail) t.action = GuardAction::fail_trial;
    return t;
  }
  return {};
}

Trip check_stages(const GuardReadings& readings) {
  const GuardHistory& seen = readings.history;
  if (seen.too_fast)
    return trip(Guard::stage_speed, "stage too fast", stage(*seen.too_fast), "its top speed",
                "positions further apart",
                "Check the parameters of the controller and its encoder");
  if (!seen.not_following) return {};
  const std::string unit = is_linear(*seen.not_following) ? " m" : " rad";
  return trip(Guard::following_error, "stage does not follow its command",
              stage(*seen.not_following), "the commanded position",
              std::to_string(seen.following_error) + unit + " away",
              "Check for an obstacle, lost steps and the speed set in the controller");
}

Trip check_host(const GuardLimits& limits, const GuardReadings& readings) {
  if (limits.cycle_max_lateness > Duration::zero() &&
      readings.cycle_lateness > limits.cycle_max_lateness)
    return trip(Guard::late_cycle, "scan cycle late", "host",
                "at most " + seconds(limits.cycle_max_lateness), seconds(readings.cycle_lateness),
                "Run the program with real-time priority");
  return {};
}

Trip check_disk(const GuardLimits& limits, const GuardReadings& readings) {
  if (!readings.free_bytes || *readings.free_bytes >= limits.least_free_bytes) return {};
  return trip(Guard::disk, "disk nearly full", "recording",
              "at least " + std::to_string(limits.least_free_bytes) + " bytes free",
              std::to_string(*readings.free_bytes) + " bytes",
              "Free disk space, then resume the campaign");
}

}  // namespace

const std::array<GuardRule, guard_count>& guard_table() {
  return rules;
}

std::string_view to_string(Guard guard) {
  const auto i = static_cast<std::size_t>(guard);
  return i < rules.size() ? rules[i].name : "unknown";
}

std::string_view to_string(GuardAction action) {
  constexpr std::array<std::string_view, 4> names{"hold", "retract", "retract and end",
                                                  "stop after the trial"};
  static_assert(names.size() == static_cast<std::size_t>(GuardAction::finish_trial) + 1);
  const auto i = static_cast<std::size_t>(action);
  return i < names.size() ? names[i] : "unknown";
}

std::optional<GuardTrip> evaluate(const GuardLimits& limits, const GuardReadings& readings,
                                  TimePoint now) {
  if (Trip t = check_wrench(limits, readings)) return t;
  if (Trip t = check_taxels(limits, readings)) return t;
  if (Trip t = check_frozen(Guard::frozen_wrench, "wrench", readings.history.wrench_frozen,
                            limits.wrench_longest_frozen))
    return t;
  if (Trip t = check_travel(limits, readings)) return t;
  if (Trip t = check_stages(readings)) return t;
  if (Trip t = check_ages(limits, readings, now)) return t;
  if (Trip t = check_frozen(Guard::frozen_taxels, "taxels", readings.history.taxels_frozen,
                            limits.taxels_longest_frozen))
    return t;
  if (Trip t = check_host(limits, readings)) return t;
  if (Trip t = check_deadline(readings, now)) return t;
  if (Trip t = check_disk(limits, readings)) return t;
  return check_jump(limits, readings);
}

}  // namespace weft::recipes
