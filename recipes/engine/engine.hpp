#pragma once
// The campaign as a pure machine: step(plan, state, event, now) gives the next state and what to
// do. The daemon carries the effects out, in order, and feeds the outcomes back as events.
//
// Tickets. Each state that waits gets a new ticket; every effect that asks for an answer carries it
// and the answer must bring it back. Answers with an old ticket (a timer that was not cancelled, a
// motion that was replaced) are ignored, so that nobody has to cancel anything.
//
// Order of a trial: clear (first trial only), mount, position, bias, approach, seat, lower to rest,
// S, press, P, M (one leg at a time), release, unload to rest, E, retract; a press alone goes from
// P to release.
// After the last one comes what the recipe does finally (motion.hpp), where the probe is up.
// Between two trials, and before the first, a person may be asked for something
// (operator_steps.hpp): the stages are at rest then and the probe is up, and it goes up again
// before anything else moves. P is recorded once the force has settled in its band, so that P is at
// the set point (the paper's "controlled pressure"); E at a height of rest that the release finds
// anew, because the cloth has sunk in under the load: there the probe's weight alone acts, as in S.
// Both are held against the weight.
//
// Under a set point below the weight the stage carries a part of it: the probe hangs on the stop at
// the lower end of its mount's slack. A set point of 0 is a stroke above the cloth.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "protocols/base/phase.hpp"
#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"
#include "recipes/control/guards.hpp"
#include "recipes/engine/operator_steps.hpp"
#include "recipes/engine/plan.hpp"

namespace weft::recipes {

/// Version of how a trial is carried out and simulated. A campaign is gone on with by the rules
/// that it was begun with, or not at all: its trials would not be comparable (docs/adr/0021).
inline constexpr int engine_rules = 5;
/// The journal's line with it, {"rules": 5}, once a campaign; a campaign without one has 1.
inline constexpr std::string_view rules_kind = "rules";

using Ticket = std::uint32_t;

// ---- effects: what the daemon is asked to do ----

/// Ask a person for this; answer OperatorConfirmed when it is done.
struct PromptOperator {
  Ticket ticket = 0;
  StepPrompt prompt;
};
/// A trial begins. Everything up to TrialDone belongs to it.
struct TrialBegin {
  std::size_t trial = 0;  ///< into Plan::trials
};
/// Have this piece of this fabric on the plate as it was mounted then; answer Mounted. What is
/// already there needs no person.
struct MountFabric {
  Ticket ticket = 0;
  std::string fabric;
  TrialPlace place;
  TrialSeeds seeds;
};
struct AxisMove {
  Axis axis = Axis::x;
  double target = 0;     ///< [m] or [rad]
  double speed = 0;      ///< [m/s] or [rad/s], > 0; axes of one leg have speeds in proportion
  bool unhomed = false;  ///< as MoveCommand has it
};
/// Move these axes together; answer MotionDone when every one of them confirmed and agrees, or
/// MotionLost when one of them cannot any more. Replaces motions of the same axes. While the force
/// loop is on, z is never among them.
struct MoveTo {
  Ticket ticket = 0;
  std::vector<AxisMove> moves;
};
/// Take the present force as zero; answer Biased when the readings agree.
struct BiasSensors {
  Ticket ticket = 0;
};
/// Lower z at `speed_mps` until the normal force reaches `stop_force_n`: stop z and answer
/// ForceReached. When z arrives at `target_z_m` without that, answer MotionDone.
struct Descend {
  Ticket ticket = 0;
  double target_z_m = 0;
  double speed_mps = 0;
  double stop_force_n = 0;
};
/// The mirror of Descend: raise z until the normal force has fallen to `stop_force_n`.
struct Ascend {
  Ticket ticket = 0;
  double target_z_m = 0;
  double speed_mps = 0;
  double stop_force_n = 0;
};
/// Switch the force loop on; answer ForceSettled after `dwell_s` inside the band. It stays on until
/// ReleaseForce.
struct HoldForce {
  Ticket ticket = 0;
  double force_n = 0;
  double band_n = 0;
  double dwell_s = 0;
};
/// Switch the force loop off; z stands still.
struct ReleaseForce {};
/// Samples from now on belong to this phase; Phase::none is not recorded.
struct SetPhase {
  Phase phase = Phase::none;
};
/// Answer TimerExpired{ticket} at `deadline`. Replaces the timer before it.
struct ArmTimer {
  Ticket ticket = 0;
  TimePoint deadline;
};
/// Stop all axes now and switch the force loop off. No answer.
struct StopMotion {};

enum class Outcome {
  complete,
  stopped,
  aborted,
  failed,
  interrupted,
  rejected  ///< of a trial alone: its record is bad, and it is taken again
};
enum class Cleanup { done, partial, failed, skipped };
enum class RigFact { safe, holding, moving, unknown, latched };
std::string_view to_string(Outcome outcome);
std::string_view to_string(Cleanup cleanup);
std::string_view to_string(RigFact rig);

struct TrialDone {
  std::size_t trial = 0;
  Outcome outcome = Outcome::complete;
  Cleanup cleanup = Cleanup::done;
  std::optional<Error> error;  ///< why it is not complete
  bool ended_early = false;    ///< complete, but for a slide that told enough before its end
};
/// The machine has ended; the three facts of the run.
struct CampaignDone {
  Outcome outcome = Outcome::complete;
  Cleanup cleanup = Cleanup::done;
  RigFact rig = RigFact::safe;
  std::optional<Error> error;  ///< the first one
};

using Effect =
    std::variant<PromptOperator, TrialBegin, MountFabric, MoveTo, BiasSensors, Descend, Ascend,
                 HoldForce, ReleaseForce, SetPhase, ArmTimer, StopMotion, TrialDone, CampaignDone>;

// ---- events: what the daemon reports ----

/// Stages are homed, sensors stream. `first_trial` > 0 goes on with a campaign that was
/// interrupted.
struct Start {
  std::size_t first_trial = 0;
  std::uint32_t rejected = 0;  ///< takes of that trial so far
};
/// The person has done what PromptOperator asked for.
struct OperatorConfirmed {
  Ticket ticket = 0;
};
struct Mounted {
  Ticket ticket = 0;
};
struct Biased {
  Ticket ticket = 0;
};
struct MotionDone {
  Ticket ticket = 0;
};
/// MotionDone will never come: a stage that MoveTo named has failed or refused. The Fault that says
/// why is told first.
struct MotionLost {
  Ticket ticket = 0;
};
/// What Descend or Ascend was to stop at.
struct ForceReached {
  Ticket ticket = 0;
  double z_m = 0;  ///< where z was at that moment
};
/// What the probe rested with in phase S or E, told when the phase is over.
struct RestMeasured {
  Phase phase = Phase::none;
  double mean_n = 0;
  double error_n = 0;  ///< of the mean, a standard deviation
};
struct ForceSettled {
  Ticket ticket = 0;
};
struct TimerExpired {
  Ticket ticket = 0;
  std::optional<Error> awaited{};  ///< what never came, where the bench knows more than its step
};
/// What was recorded of the trial under way is bad. It is taken again once the probe is up, as
/// often as the recipe allows; then it has failed.
struct AttemptRejected {
  Error why;
};
/// The slide has told enough: it ends here as at the end of its path, and the trial goes on with
/// its release. Where the plan does not ask for that, and in every other step, nothing happens.
struct EndSlide {};
/// A device failed: the trial fails, the rig is cleaned up and the campaign ends.
struct Fault {
  Error error;
};
/// A guard tripped; its action says how much ends.
struct GuardTripped {
  GuardTrip trip;
};
/// Finish the trial under way, then end.
struct StopRequested {};
/// Hold before the next trial, or at once: then the trial under way is cut short and run again
/// after the pause.
struct PauseRequested {
  bool at_once = false;
};
/// Go on. The next trial begins as the first one did: up, position, bias.
struct ResumeRequested {};
/// End the trial now: stop, retract, end.
struct AbortRequested {};
/// End at once and leave the rig as it stands: no clean-up.
struct HaltRequested {};

using Event = std::variant<Start, OperatorConfirmed, Mounted, Biased, MotionDone, MotionLost,
                           ForceReached, RestMeasured, ForceSettled, TimerExpired, AttemptRejected,
                           EndSlide, Fault, GuardTripped, PauseRequested, ResumeRequested,
                           StopRequested, AbortRequested, HaltRequested>;

// ---- state ----

enum class Step : std::uint8_t {
  ready,              ///< waits for Start; the only state before the end without a timer
  clearing,           ///< z goes up to the clear height before anything else moves
  awaiting_operator,  ///< between trials, as `held`, until a person has confirmed
  mounting,
  positioning,
  biasing,
  approaching,
  seating,     ///< slowly on until the cloth bears the probe
  lowering,    ///< on by the rest travel: the mount is slack, the weight alone acts
  resting,     ///< S
  lifting,     ///< for a set point below the weight: up to the stop, or above the cloth
  pressing,    ///< force loop on, waits for the band
  holding,     ///< P
  sliding,     ///< M
  releasing,   ///< to an end of the mount's slack
  unloading,   ///< into the slack by the rest travel: the weight alone acts again
  ending,      ///< E
  retracting,  ///< also the clean-up after a failure
  held,        ///< paused between trials, the probe up; for `longest_hold` at most
  concluding,  ///< what the recipe does finally, the probe up, no trial left
  done,
};
std::string_view to_string(Step step);

/// A pause that nobody ends by then, or an operator step that nobody confirms, ends the campaign as
/// stopped.
inline constexpr Duration longest_hold = std::chrono::hours(24);

/// The whole memory of the machine.
struct State {
  Step step = Step::ready;
  Ticket ticket = 0;              ///< of the state's answers; its timer carries it too
  std::size_t trial = 0;          ///< into Plan::trials
  std::size_t leg = 0;            ///< into the path of M, while sliding
  std::size_t first_trial = 0;    ///< that Start named
  std::size_t operator_step = 0;  ///< of the plan's, to be looked at next for the trial
  double rest_z_m = 0;            ///< where the weight alone acts, found by this trial's touch
  bool stop_requested = false;
  bool pause_requested = false;
  bool ended_early = false;              ///< the slide was, by EndSlide
  bool repeats = false;                  ///< the trial was cut short for a pause and is run again
  std::uint32_t rejected = 0;            ///< takes of the trial so far
  std::optional<Error> bad_attempt;      ///< why the take under way is one
  std::optional<Outcome> trial_outcome;  ///< set when the trial is cut short
  std::optional<Error> trial_error;
  std::optional<Outcome> campaign_outcome;  ///< set when the campaign ends after this trial
  std::optional<Error> first_error;
  std::size_t last_step = 0;  ///< of what is done finally, the one after that under way
  TimePoint last_until{};     ///< when the budget for it is used up
  std::size_t completed = 0;  ///< trials that ended complete
  std::size_t failed = 0;     ///< trials that ended otherwise
};

struct Transition {
  State next;
  std::vector<Effect> effects;  ///< in order of execution
};

/// Total: an event that a state does not expect changes nothing. Whatever happens after Start, the
/// machine ends in Step::done, and every step before it has a timer.
///
/// Nothing interrupts the retreat of the probe but HaltRequested, its own timer and MotionLost: any
/// other fault or guard that speaks up meanwhile is noted and ends the campaign afterwards. What is
/// done finally ends with any of them, and changes the outcome only of a campaign that it could not
/// clean up after: `cleanup` is then partial.
Transition step(const Plan& plan, const State& state, const Event& event, TimePoint now);

}  // namespace weft::recipes
