#include "recipes/control/guards.hpp"

#include <cmath>
#include <string>

namespace weft::recipes {
namespace {

using Trip = std::optional<GuardTrip>;

GuardTrip trip(Guard guard, GuardAction action, std::string message, std::string where,
               std::string expected, std::string got, std::string hint = {}) {
  return {guard, action,
          Error{Errc::safety, std::move(message), std::move(where), std::move(expected),
                std::move(got), std::move(hint)}};
}

double magnitude(const std::array<double, 3>& v) {
  return std::hypot(v[0], v[1], v[2]);
}

/// True also for NaN: a reading that cannot be compared is not a safe one.
bool over(double value, double cap) {
  return !(value <= cap);
}

Trip check_wrench(const GuardLimits& limits, const GuardReadings& readings) {
  if (const double force = magnitude(readings.force_n); over(force, limits.force_cap_n))
    return trip(Guard::force_cap, GuardAction::fail_trial, "the force is over the cap", "wrench",
                "<= " + std::to_string(limits.force_cap_n) + " N", std::to_string(force) + " N",
                "Look at the cloth and at the probe's mount");
  if (const double torque = magnitude(readings.torque_nm); over(torque, limits.torque_cap_nm))
    return trip(Guard::torque_cap, GuardAction::fail_trial, "the torque is over the cap", "wrench",
                "<= " + std::to_string(limits.torque_cap_nm) + " N m",
                std::to_string(torque) + " N m", "Look whether the probe is caught in the cloth");
  if (!readings.wrench_valid)
    return trip(Guard::stale_wrench, GuardAction::end_campaign,
                "the force/torque sensor marks its readings as wrong", "wrench",
                "a good status word", "an error bit",
                "Read the sensor's status; it may be saturated");
  return {};
}

Trip check_travel(const GuardLimits& limits, const GuardReadings& readings) {
  for (const Axis axis : all_axes) {
    const Range& range = limits.travel[index(axis)];
    const double position = readings.position[axis];
    if (position >= range.min - limits.travel_slack && position <= range.max + limits.travel_slack)
      continue;
    const std::string unit = is_linear(axis) ? " m" : " rad";
    return trip(Guard::travel, GuardAction::end_campaign, "a stage is outside its travel",
                "stage " + std::string(to_string(axis)),
                std::to_string(range.min) + " to " + std::to_string(range.max) + unit,
                std::to_string(position) + unit, "Home the stage again");
  }
  return {};
}

/// Runs every cycle for every stream, so words are only put together once something is wrong.
Trip check_age(Guard guard, std::string_view device, const std::optional<TimePoint>& at,
               Duration max_age, TimePoint now) {
  if (at && now - *at <= max_age) return {};
  const std::string got =
      at ? std::to_string(to_seconds(now - *at)) + " s old" : std::string("no reading yet");
  const std::string where = (guard == Guard::stale_stage ? "stage " : "") + std::string(device);
  return trip(guard, GuardAction::end_campaign, "readings have stopped", where,
              "a reading at most " + std::to_string(to_seconds(max_age)) + " s old", got,
              "Check the device's cable and power");
}

Trip check_ages(const GuardLimits& limits, const GuardReadings& readings, TimePoint now) {
  if (Trip t =
          check_age(Guard::stale_wrench, "wrench", readings.wrench_at, limits.wrench_max_age, now))
    return t;
  for (const Axis axis : all_axes)
    if (Trip t = check_age(Guard::stale_stage, to_string(axis), readings.stage_at[index(axis)],
                           limits.stage_max_age, now))
      return t;
  return check_age(Guard::stale_taxels, "taxels", readings.taxels_at, limits.taxels_max_age, now);
}

Trip check_deadline(const GuardReadings& readings, TimePoint now) {
  if (!readings.deadline || now <= *readings.deadline) return {};
  return trip(Guard::deadline, GuardAction::fail_trial, "a step has passed its deadline", "engine",
              "an end by " + std::to_string(to_seconds(*readings.deadline)) + " s",
              std::to_string(to_seconds(now)) + " s");
}

}  // namespace

std::string_view to_string(Guard guard) {
  switch (guard) {
    case Guard::force_cap:
      return "force_cap";
    case Guard::torque_cap:
      return "torque_cap";
    case Guard::travel:
      return "travel";
    case Guard::stale_wrench:
      return "stale_wrench";
    case Guard::stale_taxels:
      return "stale_taxels";
    case Guard::stale_stage:
      return "stale_stage";
    case Guard::deadline:
      return "deadline";
  }
  return "unknown";
}

std::optional<GuardTrip> evaluate(const GuardLimits& limits, const GuardReadings& readings,
                                  TimePoint now) {
  if (Trip t = check_wrench(limits, readings)) return t;
  if (Trip t = check_travel(limits, readings)) return t;
  if (Trip t = check_ages(limits, readings, now)) return t;
  return check_deadline(readings, now);
}

}  // namespace weft::recipes
