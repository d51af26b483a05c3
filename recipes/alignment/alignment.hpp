#pragma once
// Surface alignment as a pure machine: step(plan, state, event, now) returns the next state and
// effects. Effects, events and tickets are those of the campaign engine.
//
// A round touches every point of the grid, fits the plane and compares its normal with the probe's
// axis. After the first round rx (the plate) and ry (the probe) compensate the tilt; the next round
// verifies it. Each touch is an approach at speed, a step back and a slow descent. Every motion
// ends by itself (docs/adr/0002), and every step has a timer.
//
// Limits of a touch. A height is that of the face's centre when an edge of the face meets the
// plate. With the rotary stages at rest this offset is equal at every point, so the slope does not
// change. An error of the face against its guide also moves all touches equally and is not
// measured.

#include <optional>
#include <variant>
#include <vector>

#include "recipes/alignment/align_plan.hpp"
#include "recipes/alignment/plane_fit.hpp"
#include "recipes/engine/engine.hpp"

namespace weft::recipes {

/// Result of a round: the tilt of the plate against the probe's axis. Signs are those of the rotary
/// stages: with x > 0 the plate is higher at larger y, with y > 0 at larger x. Turning rx by -x and
/// ry by +y levels it.
struct TiltFound {
  PlaneFit plane;  ///< fabric frame
  Tilts stages;    ///< angles of the rotary stages during the round
  Tilts level;     ///< angles of the rotary stages that align the probe's axis with the normal
  double tilt_x_rad = 0;
  double tilt_y_rad = 0;
  double lean_rad = 0;     ///< angle between the axis and the normal
  double lean_sd_rad = 0;  ///< standard deviation, both slopes combined
};

/// Compares a plane with the angles of the rotary stages. Errors: those of tilts_along().
Result<TiltFound> compute_tilt(const PlaneFit& plane, const Tilts& stages);

/// The machine has ended, with the three facts of a campaign.
struct AlignDone {
  Outcome outcome = Outcome::complete;
  Cleanup cleanup = Cleanup::done;
  RigFact rig = RigFact::safe;
  std::optional<Error> error;  ///< reason when the outcome is not complete
};

using AlignEffect = std::variant<MoveTo, BiasSensors, Descend, ArmTimer, StopMotion, AlignDone>;

enum class AlignStep : std::uint8_t {
  ready,
  clearing,  ///< z goes up before anything else moves
  turning,   ///< rotary stages to the angles of the round, x and y over the first point
  biasing,
  crossing,     ///< moving over the next point
  approaching,  ///< descending at speed until contact
  backing,      ///< moving up a little
  touching,     ///< descending slowly: the touch that counts
  lifting,
  retracting,  ///< at the end, or as the clean-up after a failure
  done,
};
std::string_view to_string(AlignStep step);

/// The whole state of the machine.
struct AlignState {
  AlignStep step = AlignStep::ready;
  Ticket ticket = 0;
  std::size_t point = 0;            ///< index into AlignPlan::points_m
  Tilts tilts;                      ///< angles of the round
  double last_z_m = 0;              ///< z at the last contact
  std::vector<TouchPoint> touches;  ///< touches of the round
  std::vector<TiltFound> rounds;  ///< finished rounds; the first one is the tilt before correction
  Outcome outcome = Outcome::complete;
  std::optional<Error> error;  ///< the first one
};

/// Whether the probe is retracting: a retract continues after a guard trips.
inline bool is_retreating(const AlignState& state) {
  return state.step == AlignStep::retracting;
}
/// Whether the bias of the force sensor may still change.
inline bool zero_moves(const AlignState& state) {
  return state.step < AlignStep::crossing;
}

struct AlignTransition {
  AlignState next;
  std::vector<AlignEffect> effects;
};

/// Total: a state ignores an event that it does not expect. After Start the machine always ends in
/// AlignStep::done. It handles these events of the engine: Start, Biased, MotionDone, MotionLost,
/// ForceReached, TimerExpired, Fault, GuardTripped, AbortRequested and HaltRequested.
AlignTransition step(const AlignPlan& plan, const AlignState& state, const Event& event,
                     TimePoint now);

}  // namespace weft::recipes
