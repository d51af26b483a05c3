#pragma once
// Guards: evaluated in every cycle before any command is sent. Pure; the first guard that trips is
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

/// Effect of a guard that trips. With any effect no other command of that cycle is sent.
enum class GuardAction : std::uint8_t {
  hold,  ///< no command in this cycle: motion under the force loop ends when its servo command runs
         ///< out
  fail_trial,    ///< the fabric or the trial misbehaves: stop, retract, then follow the recipe
  end_campaign,  ///< the rig is not trusted: stop, retract and end
  finish_trial,  ///< no danger: finish the current trial, then end the campaign
};
std::string_view to_string(GuardAction action);

/// One row of the table of guards, which lists the most dangerous guard first.
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
  double force_cap_n = 0;    ///< limit of the magnitude of the force
  double torque_cap_nm = 0;  ///< limit of the magnitude of the torque
  std::array<Range, axis_count> travel{};
  std::array<bool, axis_count> fixed{};  ///< axes without a stage; they have no readings
  double travel_slack = 5e-6;   ///< rounding and overshoot that is not a violation [m] or [rad]
  double taxel_cap_counts = 0;  ///< largest change of a taxel, without force sensor; 0: not checked
  Duration wrench_max_age{};    ///< zero: no force sensor
  Duration taxels_max_age{};
  Duration stage_max_age{};
  Duration wrench_longest_frozen{};  ///< zero: not checked
  Duration taxels_longest_frozen{};
  double wrench_jump_n = 0;       ///< between two readings; for the message
  Duration cycle_max_lateness{};  ///< zero: not checked
  std::uint64_t least_free_bytes = 0;
};

/// Findings over the last cycles, made by GuardWatch.
struct GuardHistory {
  Duration wrench_frozen{};           ///< time for which all six components have not changed
  Duration taxels_frozen{};           ///< time for which all counts of an array have not changed
  unsigned wrench_jumps = 0;          ///< readings in a row far from the last accepted one
  double wrench_jump_n = 0;           ///< size of the jump
  std::optional<Axis> too_fast;       ///< a stage that covered more than its speed allows
  std::optional<Axis> not_following;  ///< a stage that is not at its commanded position
  double following_error = 0;         ///< error of that stage [m] or [rad]
};

/// The newest readings. A reading that never came counts as stale.
struct GuardReadings {
  std::array<double, 3> force_n{};
  std::array<double, 3> torque_nm{};
  bool wrench_valid = true;
  double taxel_change = 0;  ///< largest change of a taxel since the probe hung free [counts]
  std::optional<TimePoint> wrench_at;
  std::optional<TimePoint> taxels_at;  ///< of the array with the oldest frame
  Joints position;
  std::array<std::optional<TimePoint>, axis_count> stage_at{};
  std::optional<TimePoint> deadline;        ///< of the current state of the engine
  Duration cycle_lateness{};                ///< of this cycle
  std::optional<std::uint64_t> free_bytes;  ///< on the disk of the campaign, if known
  GuardHistory history;
};

struct GuardTrip {
  Guard guard = Guard::deadline;
  GuardAction action = GuardAction::end_campaign;
  Error error;
};

/// The most dangerous guard that trips, or nullopt. A jump of one reading comes last: it only skips
/// a cycle and must not hide a guard that ends a trial.
std::optional<GuardTrip> evaluate(const GuardLimits& limits, const GuardReadings& readings,
                                  TimePoint now);

}  // namespace weft::recipes
