#pragma once
// Guards: evaluated in every cycle, before any command goes out. Pure; the first that trips is
// returned.

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"
#include "recipes/kinematics/kinematics.hpp"

namespace weft::recipes {

enum class Guard : std::uint8_t {
  invalid_wrench,
  force_cap,
  torque_cap,
  taxel_cap,
  frozen_wrench,
  wrench_jump,
  travel,
  stage_speed,
  following_error,
  stale_wrench,
  stale_stage,
  stale_taxels,
  frozen_taxels,
  late_cycle,
  deadline,
  disk
};

/// What a guard that trips does. Whatever it is, no other command of that cycle goes out.
enum class GuardAction : std::uint8_t {
  hold,          ///< nothing is commanded in this cycle: what moves under the force loop stands
                 ///< still once its servo command has run out
  fail_trial,    ///< the cloth or the trial misbehaves: stop, retract, then as the recipe says
  end_campaign,  ///< the rig cannot be trusted: stop, retract and end
  finish_trial,  ///< nothing is in danger: the trial under way is finished, then the campaign ends
};
std::string_view to_string(GuardAction action);

/// One line of the table: every guard that a cycle evaluates, most dangerous first.
struct GuardRule {
  Guard guard;
  std::string_view name;
  GuardAction action;
  std::string_view trips_when;
};
inline constexpr std::size_t guard_count = 16;
const std::array<GuardRule, guard_count>& guard_table();
std::string_view to_string(Guard guard);

struct GuardLimits {
  double force_cap_n = 0;    ///< on the magnitude of the force
  double torque_cap_nm = 0;  ///< on the magnitude of the torque
  std::array<Range, axis_count> travel{};
  std::array<bool, axis_count> fixed{};  ///< axes without a stage, of which no reading comes
  double travel_slack = 5e-6;   ///< rounding and overshoot that is not a violation [m] or [rad]
  double taxel_cap_counts = 0;  ///< on any taxel's change, without a force sensor; 0: not looked at
  Duration wrench_max_age{};    ///< zero: there is no force sensor
  Duration taxels_max_age{};
  Duration stage_max_age{};
  Duration wrench_longest_frozen{};  ///< zero: not looked at
  Duration taxels_longest_frozen{};
  double wrench_jump_n = 0;       ///< between two readings; for the message
  Duration cycle_max_lateness{};  ///< zero: not looked at
  std::uint64_t least_free_bytes = 0;
};

/// What the readings of the last cycles say together; made by GuardWatch.
struct GuardHistory {
  Duration wrench_frozen{};           ///< all six components unchanged for so long
  Duration taxels_frozen{};           ///< all counts of an array unchanged for so long
  unsigned wrench_jumps = 0;          ///< readings in a row far from the last one believed
  double wrench_jump_n = 0;           ///< how far
  std::optional<Axis> too_fast;       ///< a stage that covered more than its speed allows
  std::optional<Axis> not_following;  ///< a stage that is not where its command has put it
  double following_error = 0;         ///< of that stage [m] or [rad]
};

/// The newest readings. A reading that never came counts as stale.
struct GuardReadings {
  std::array<double, 3> force_n{};
  std::array<double, 3> torque_nm{};
  bool wrench_valid = true;
  double taxel_change = 0;  ///< largest change of a taxel since the probe hung free [counts]
  std::optional<TimePoint> wrench_at;
  std::optional<TimePoint> taxels_at;  ///< of the array that has been silent longest
  Joints position;
  std::array<std::optional<TimePoint>, axis_count> stage_at{};
  std::optional<TimePoint> deadline;        ///< of the state the engine is in
  Duration cycle_lateness{};                ///< of this cycle
  std::optional<std::uint64_t> free_bytes;  ///< where the campaign is recorded, when known
  GuardHistory history;
};

struct GuardTrip {
  Guard guard = Guard::deadline;
  GuardAction action = GuardAction::end_campaign;
  Error error;
};

/// What is wrong, most dangerous first, or nothing. A jump of one reading comes last: it only
/// holds, and must not hide what ends a trial.
std::optional<GuardTrip> evaluate(const GuardLimits& limits, const GuardReadings& readings,
                                  TimePoint now);

}  // namespace weft::recipes
