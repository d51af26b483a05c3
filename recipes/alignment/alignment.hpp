#pragma once
// Surface alignment as a pure machine: step(plan, state, event, now) gives the next state and what
// to do, with the effects, events and tickets of the campaign engine.
//
// A round touches every point of the grid, fits the plane and compares its normal with the probe's
// axis. The first round's tilt is turned away with rx (the platform) and ry (the probe), the next
// round verifies it. Each touch is an approach at speed, a step back and a slow descent; every
// motion ends by itself (docs/adr/0002), and every step has a timer.
//
// What a touch sees. Heights are those of the face's centre when an edge of the face meets the
// plate: with the rotary stages at rest the offset is the same at every point, so the plane's slope
// is not touched by it. The face's own error against its guide moves all touches alike too and
// stays unseen.

#include <optional>
#include <variant>
#include <vector>

#include "recipes/alignment/align_plan.hpp"
#include "recipes/alignment/plane_fit.hpp"
#include "recipes/engine/engine.hpp"

namespace weft::recipes {

/// A round's outcome. The plate against the probe's axis, signs as the rotary stages count: x > 0
/// lies higher at larger y, y > 0 higher at larger x. Turning rx by -x and ry by +y levels it.
struct TiltFound {
  PlaneFit plane;  ///< fabric frame
  Tilts stages;    ///< of the rotary stages during the round
  Tilts level;     ///< of the rotary stages that put the probe's axis along the normal
  double tilt_x_rad = 0;
  double tilt_y_rad = 0;
  double lean_rad = 0;     ///< angle between the axis and the normal
  double lean_sd_rad = 0;  ///< standard deviation, both slopes' together
};

/// Compares a plane with where the rotary stages stand. Errors: those of tilts_along().
Result<TiltFound> compute_tilt(const PlaneFit& plane, const Tilts& stages);

/// The machine has ended, with the three facts of a campaign.
struct AlignDone {
  Outcome outcome = Outcome::complete;
  Cleanup cleanup = Cleanup::done;
  RigFact rig = RigFact::safe;
  std::optional<Error> error;  ///< why it is not complete
};

using AlignEffect = std::variant<MoveTo, BiasSensors, Descend, ArmTimer, StopMotion, AlignDone>;

enum class AlignStep : std::uint8_t {
  ready,
  clearing,  ///< z up before anything else moves
  turning,   ///< rotary stages to where the round has them, x and y over the first point
  biasing,
  crossing,     ///< over the next point
  approaching,  ///< down at speed until contact
  backing,      ///< a little up
  touching,     ///< slowly down: the touch that counts
  lifting,
  retracting,  ///< the end, or the clean-up after a failure
  done,
};
std::string_view to_string(AlignStep step);

/// The whole memory of the machine.
struct AlignState {
  AlignStep step = AlignStep::ready;
  Ticket ticket = 0;
  std::size_t point = 0;            ///< into AlignPlan::points_m
  Tilts tilts;                      ///< of the round
  double last_z_m = 0;              ///< where z met the surface last
  std::vector<TouchPoint> touches;  ///< of the round
  std::vector<TiltFound> rounds;    ///< that are over; the first is the tilt before
  Outcome outcome = Outcome::complete;
  std::optional<Error> error;  ///< the first one
};

/// What a guarded cycle asks of a machine: a retreat goes on after a trip.
inline bool is_retreating(const AlignState& state) {
  return state.step == AlignStep::retracting;
}
/// The force sensor takes its zero, or did not yet.
inline bool zero_moves(const AlignState& state) {
  return state.step < AlignStep::crossing;
}

struct AlignTransition {
  AlignState next;
  std::vector<AlignEffect> effects;
};

/// Total: an event that a state does not expect changes nothing. After Start the machine always
/// ends in AlignStep::done. Of the engine's events it knows Start, Biased, MotionDone,
/// MotionLost, ForceReached, TimerExpired, Fault, GuardTripped, AbortRequested and HaltRequested.
AlignTransition step(const AlignPlan& plan, const AlignState& state, const Event& event,
                     TimePoint now);

}  // namespace weft::recipes
