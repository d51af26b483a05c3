#pragma once
// Guards: evaluated in every cycle, before any command goes out. Pure; the first that trips is
// returned.

#include <array>
#include <optional>
#include <string_view>

#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"
#include "recipes/kinematics/kinematics.hpp"

namespace weft::recipes {

enum class Guard {
  force_cap,
  torque_cap,
  travel,
  stale_wrench,
  stale_taxels,
  stale_stage,
  deadline
};
std::string_view to_string(Guard guard);

/// How much ends when a guard trips.
enum class GuardAction {
  fail_trial,    ///< the cloth or the trial misbehaves: retract, then as the recipe says
  end_campaign,  ///< the rig cannot be trusted: retract and end
};

struct GuardLimits {
  double force_cap_n = 0;    ///< on the magnitude of the force
  double torque_cap_nm = 0;  ///< on the magnitude of the torque
  std::array<Range, axis_count> travel{};
  double travel_slack = 5e-6;  ///< rounding and overshoot that is not a violation [m] or [rad]
  Duration wrench_max_age{};
  Duration taxels_max_age{};
  Duration stage_max_age{};
};

/// The newest readings. A reading that never came counts as stale.
struct GuardReadings {
  std::array<double, 3> force_n{};
  std::array<double, 3> torque_nm{};
  bool wrench_valid = true;
  std::optional<TimePoint> wrench_at;
  std::optional<TimePoint> taxels_at;
  Joints position;
  std::array<std::optional<TimePoint>, axis_count> stage_at{};
  std::optional<TimePoint> deadline;  ///< of the state the engine is in
};

struct GuardTrip {
  Guard guard = Guard::deadline;
  GuardAction action = GuardAction::end_campaign;
  Error error;
};

/// What is wrong, most dangerous first, or nothing.
std::optional<GuardTrip> evaluate(const GuardLimits& limits, const GuardReadings& readings,
                                  TimePoint now);

}  // namespace weft::recipes
