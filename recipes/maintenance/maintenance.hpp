#pragma once
// Motion outside a campaign as a pure machine, with the effects, events and tickets of the campaign
// engine: retract lifts the probe, park retracts and then moves x, y, rx and ry, jog moves one axis
// a little. Nothing homes a stage. Every target, speed and time is bounded before anything moves.
//
// z goes up first. A way up goes on whatever guard trips, as the retreat of a trial does; a way
// down is driven by velocities that end by themselves (docs/adr/0002).

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>
#include <variant>
#include <vector>

#include "protocols/base/time.hpp"
#include "recipes/engine/engine.hpp"
#include "recipes/engine/rig_limits.hpp"

namespace weft::recipes {

enum class MaintenanceKind : std::uint8_t { retract, park, jog };
std::string_view to_string(MaintenanceKind kind);

struct MaintenanceOrder {
  MaintenanceKind kind = MaintenanceKind::retract;
  Axis axis = Axis::z;  ///< of a jog
  double distance = 0;  ///< of a jog [m] or [rad]; z counts downwards
};

inline constexpr double longest_jog_m = 5e-3;
inline constexpr double longest_jog_rad = 1 * rad_per_deg;
/// A jog goes at this share of the axis's speed.
inline constexpr double jog_speed_share = 0.1;
/// Largest change of force during a jog that does not lift the probe [N].
inline constexpr double jog_force_n = 1;

/// What needs no bench. Errors: range, a jog without a distance or with one that is too long.
Status check_order(const MaintenanceOrder& order);

/// What the devices report before anything moves.
struct BenchFound {
  Joints joints;  ///< of a stage that has not been homed: from where its controller was switched on
  std::array<bool, axis_count> homed{};
  std::optional<double> force_n = {};  ///< magnitude; nothing where no reading came
};

/// One motion. The next one begins when it has ended.
struct MaintenanceLeg {
  std::vector<AxisMove> moves = {};
  bool lowers = false;   ///< z, by velocities
  bool lifts = false;    ///< z; no guard and no fault of another device ends it
  bool ends_up = false;  ///< the probe is known to be up after it
  double timeout_s = 0;
};

struct MaintenancePlan {
  RigLimits limits;  ///< for the guards: force cap and travel are those of this order
  std::vector<MaintenanceLeg> legs;
  bool begins_up = false;    ///< the probe is known to be up
  bool is_relative = false;  ///< z has not been homed: it goes up from where it is
};

/// Errors: wrong_state, a stage that has to be homed is not; range, a target outside the travel or
/// below the plate; measurement, no force reading or one at the rig's cap.
Result<MaintenancePlan> plan_maintenance(const RigLimits& limits, const MaintenanceOrder& order,
                                         const BenchFound& found);

/// The machine has ended. `rig`: safe, the probe is up; holding, it is not known to be up and
/// everything is at rest; unknown, a stage may be anywhere.
struct MaintenanceDone {
  Outcome outcome = Outcome::complete;
  RigFact rig = RigFact::safe;
  std::optional<Error> error;  ///< the first one; a way up may be complete all the same
};

using MaintenanceEffect = std::variant<MoveTo, Descend, ArmTimer, StopMotion, MaintenanceDone>;

/// The whole memory of the machine.
struct MaintenanceState {
  enum class Step : std::uint8_t { ready, moving, done };
  Step step = Step::ready;
  std::size_t leg = 0;
  bool is_up = false;    ///< the probe is known to be up
  bool lifting = false;  ///< the leg under way lifts
  Ticket ticket = 0;
  std::optional<Error> error;
};

/// What a guarded cycle asks of a machine: a retreat goes on after a trip.
inline bool is_retreating(const MaintenanceState& state) {
  return state.lifting;
}
/// Nothing takes a new zero during the motion.
inline bool zero_moves(const MaintenanceState& /*state*/) {
  return false;
}

struct MaintenanceTransition {
  MaintenanceState next;
  std::vector<MaintenanceEffect> effects;
};

/// Total: an event that a state does not expect changes nothing. After Start the machine always
/// ends. Of the engine's events it takes Start, MotionDone, MotionLost, ForceReached, TimerExpired,
/// Fault, GuardTripped, StopRequested, AbortRequested and HaltRequested.
MaintenanceTransition step(const MaintenancePlan& plan, const MaintenanceState& state,
                           const Event& event, TimePoint now);

}  // namespace weft::recipes
