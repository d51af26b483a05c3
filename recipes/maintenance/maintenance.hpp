#pragma once
// Motion outside a campaign as a pure machine, with the effects, events and tickets of the campaign
// engine. Retract lifts the probe. Park retracts and then moves x, y, rx and ry. Jog moves one axis
// a little. No order homes a stage. Every target, speed and time is bounded before anything moves.
//
// z goes up first. An upward motion continues when a guard trips, as the retract of a trial does. A
// downward motion uses velocities that end by themselves (docs/adr/0002).

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
  Axis axis = Axis::z;  ///< for a jog
  double distance = 0;  ///< for a jog [m] or [rad]; z counts downwards
};

inline constexpr double longest_jog_m = 5e-3;
inline constexpr double longest_jog_rad = 1 * rad_per_deg;
/// A jog uses this share of the axis's top speed.
inline constexpr double jog_speed_share = 0.1;
/// Largest change of force during a jog that does not lift the probe [N].
inline constexpr double jog_force_n = 1;

/// Checks that need no bench. Errors: range, a jog with no distance or one that is too long.
Status check_order(const MaintenanceOrder& order);

/// Reports of the devices before anything moves.
struct BenchFound {
  Joints joints;  ///< position of an unhomed stage counts from its place when its controller was
                  ///< switched on
  std::array<bool, axis_count> homed{};
  std::optional<double> force_n = {};  ///< magnitude; nullopt without a reading
};

/// One motion. The next one begins after its end.
struct MaintenanceLeg {
  std::vector<AxisMove> moves = {};
  bool lowers = false;   ///< z goes down, by velocities
  bool lifts = false;    ///< z goes up; no guard and no fault of another device ends it
  bool ends_up = false;  ///< the probe is known to be up afterwards
  double timeout_s = 0;
};

struct MaintenancePlan {
  RigLimits limits;  ///< for the guards, with the force cap and travel of this order
  std::vector<MaintenanceLeg> legs;
  bool begins_up = false;    ///< the probe is known to be up
  bool is_relative = false;  ///< z has not been homed: it moves up from its present position
};

/// Errors: wrong_state, a stage that must be homed is not homed; range, a target outside the travel
/// or below the plate; measurement, no force reading or one at the rig's cap.
Result<MaintenancePlan> plan_maintenance(const RigLimits& limits, const MaintenanceOrder& order,
                                         const BenchFound& found);

/// The machine has ended. `rig` is safe when the probe is up. It is holding when the probe is not
/// known to be up and everything is at rest. It is unknown when the position of a stage is not
/// known.
struct MaintenanceDone {
  Outcome outcome = Outcome::complete;
  RigFact rig = RigFact::safe;
  std::optional<Error> error;  ///< the first one; the upward motion may be complete nevertheless
};

using MaintenanceEffect = std::variant<MoveTo, Descend, ArmTimer, StopMotion, MaintenanceDone>;

/// The whole state of the machine.
struct MaintenanceState {
  enum class Step : std::uint8_t { ready, moving, done };
  Step step = Step::ready;
  std::size_t leg = 0;
  bool is_up = false;    ///< the probe is known to be up
  bool lifting = false;  ///< the current leg goes up
  Ticket ticket = 0;
  std::optional<Error> error;
};

/// Whether the probe is retracting: a retract continues after a guard trips.
inline bool is_retreating(const MaintenanceState& state) {
  return state.lifting;
}
/// No bias is taken during the motion.
inline bool zero_moves(const MaintenanceState& /*state*/) {
  return false;
}

struct MaintenanceTransition {
  MaintenanceState next;
  std::vector<MaintenanceEffect> effects;
};

/// Total: a state ignores an event that it does not expect. After Start the machine always ends. It
/// handles these events of the engine: Start, MotionDone, MotionLost, ForceReached, TimerExpired,
/// Fault, GuardTripped, StopRequested, AbortRequested and HaltRequested.
MaintenanceTransition step(const MaintenancePlan& plan, const MaintenanceState& state,
                           const Event& event, TimePoint now);

}  // namespace weft::recipes
