#pragma once
// The campaign as a pure machine: step(plan, state, event, now) returns the next state and effects.
// The daemon executes the effects in order and reports their results as events.
//
// Tickets. Each waiting state gets a new ticket. Every effect that expects an answer carries it,
// and the answer must return it. Answers with an old ticket are ignored (an old timer, a replaced
// motion), so nothing needs to be cancelled.
//
// Order of a trial: clear (first trial only), mount, position, bias, approach, seat, lower to rest,
// S, press, P, M (one leg at a time), release, unload to rest, E, retract. A press goes from P
// directly to release. After the last trial come the final steps of the recipe (motion.hpp), if the
// probe is up. Before each trial an operator step may be due (operator_steps.hpp). The stages are
// at rest and the probe is up during the step, and z moves up again before anything else moves. P
// is recorded once the force has settled in its band: it is at the set point (the paper's
// "controlled pressure"). E is recorded at a rest height that the release finds anew, because the
// load has compressed the fabric. In S and E only the weight of the probe acts, and the recorded
// force is compared with it.
//
// With a set point below the weight the stage carries a part of the weight. The probe hangs on the
// stop at the lower end of its mount's slack. A set point of 0 is a stroke above the fabric.

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

/// Version of the rules by which a trial is carried out and simulated. A campaign can be resumed
/// only with the rules it began with: its trials would not be comparable otherwise (docs/adr/0021).
inline constexpr int engine_rules = 5;
/// Journal kind of the rules, {"rules": 5}, once per campaign. A campaign without this line has
/// rules 1.
inline constexpr std::string_view rules_kind = "rules";

using Ticket = std::uint32_t;

// ---- effects: commands to the daemon ----

/// Prompt the operator; answer OperatorConfirmed when the step is done.
struct PromptOperator {
  Ticket ticket = 0;
  StepPrompt prompt;
};
/// A trial begins. All effects up to TrialDone belong to it.
struct TrialBegin {
  std::size_t trial = 0;  ///< index into Plan::trials
};
/// Mount this piece of this fabric with this mounting number; answer Mounted. A piece that is
/// already there needs no operator.
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
  bool unhomed = false;  ///< see MoveCommand
};
/// Move these axes together. Answer MotionDone when all of them confirmed and agree, or MotionLost
/// when one of them cannot arrive. Replaces motions of the same axes. While the force loop is on, z
/// is never among them.
struct MoveTo {
  Ticket ticket = 0;
  std::vector<AxisMove> moves;
};
/// Take the present force as the bias; answer Biased when the readings agree.
struct BiasSensors {
  Ticket ticket = 0;
};
/// Lower z at `speed_mps` until the normal force reaches `stop_force_n`, then stop z and answer
/// ForceReached. If z arrives at `target_z_m` first, answer MotionDone.
struct Descend {
  Ticket ticket = 0;
  double target_z_m = 0;
  double speed_mps = 0;
  double stop_force_n = 0;
};
/// The reverse of Descend: raise z until the normal force has fallen to `stop_force_n`.
struct Ascend {
  Ticket ticket = 0;
  double target_z_m = 0;
  double speed_mps = 0;
  double stop_force_n = 0;
};
/// Switch the force loop on and answer ForceSettled after `dwell_s` inside the band. The loop stays
/// on until ReleaseForce.
struct HoldForce {
  Ticket ticket = 0;
  double force_n = 0;
  double band_n = 0;
  double dwell_s = 0;
};
/// Switch the force loop off; z stays where it is.
struct ReleaseForce {};
/// All following samples belong to this phase; Phase::none is not recorded.
struct SetPhase {
  Phase phase = Phase::none;
};
/// Answer TimerExpired{ticket} at `deadline`. Replaces the previous timer.
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
  rejected  ///< only for a trial: its record is bad, and the trial is repeated
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
  std::optional<Error> error;  ///< reason when the outcome is not complete
  bool ended_early = false;  ///< complete, but the live vote was sure before the end of the stroke
};
/// The machine has ended. These are the three facts of the run.
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

/// Stages are homed, sensors stream. `first_trial` > 0 resumes an interrupted campaign.
struct Start {
  std::size_t first_trial = 0;
  std::uint32_t rejected = 0;  ///< rejected attempts of that trial so far
};
/// The operator has completed the step of PromptOperator.
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
/// MotionDone will not come: a stage of MoveTo has failed or refused. The Fault with the reason is
/// reported first.
struct MotionLost {
  Ticket ticket = 0;
};
/// The force reached the limit of Descend or Ascend.
struct ForceReached {
  Ticket ticket = 0;
  double z_m = 0;  ///< z at that moment
};
/// Force during phase S or E, reported at the end of the phase.
struct RestMeasured {
  Phase phase = Phase::none;
  double mean_n = 0;
  double error_n = 0;  ///< standard deviation of the mean
};
struct ForceSettled {
  Ticket ticket = 0;
};
struct TimerExpired {
  Ticket ticket = 0;
  std::optional<Error> awaited{};  ///< the missing answer, if the bench can name it
};
/// The record of the current trial is bad. The trial is repeated once the probe is up, as often as
/// the recipe allows; after that it has failed.
struct AttemptRejected {
  Error why;
};
/// The live vote is sure: the stroke ends as at the end of its path, and the trial continues with
/// its release. Ignored if the plan does not allow it, and in every other step.
struct EndSlide {};
/// A device failed: the trial fails, the rig is cleaned up and the campaign ends.
struct Fault {
  Error error;
};
/// A guard tripped; its action determines what ends.
struct GuardTripped {
  GuardTrip trip;
};
/// Finish the current trial, then end.
struct StopRequested {};
/// Pause before the next trial, or at once: then the current trial ends early and is repeated after
/// the pause.
struct PauseRequested {
  bool at_once = false;
};
/// Resume. The next trial begins as the first one did: up, position, bias.
struct ResumeRequested {};
/// End the trial now: stop, retract, end.
struct AbortRequested {};
/// End at once and leave the rig as it is: no clean-up.
struct HaltRequested {};

using Event = std::variant<Start, OperatorConfirmed, Mounted, Biased, MotionDone, MotionLost,
                           ForceReached, RestMeasured, ForceSettled, TimerExpired, AttemptRejected,
                           EndSlide, Fault, GuardTripped, PauseRequested, ResumeRequested,
                           StopRequested, AbortRequested, HaltRequested>;

// ---- state ----

enum class Step : std::uint8_t {
  ready,              ///< waits for Start; the only state before the end without a timer
  clearing,           ///< z goes up to the clear height before anything else moves
  awaiting_operator,  ///< between trials, as `held`, until the operator has confirmed
  mounting,
  positioning,
  biasing,
  approaching,
  seating,     ///< slowly down until the fabric carries the probe
  lowering,    ///< down by the rest travel: the mount is slack, the weight alone acts
  resting,     ///< S
  lifting,     ///< for a set point below the weight: up to the stop, or above the fabric
  pressing,    ///< force loop on, waiting for the band
  holding,     ///< P
  sliding,     ///< M
  releasing,   ///< to one end of the mount's slack
  unloading,   ///< into the slack by the rest travel: the weight alone acts again
  ending,      ///< E
  retracting,  ///< also the clean-up after a failure
  held,        ///< paused between trials, the probe retracted; at most `longest_hold`
  concluding,  ///< final steps of the recipe, the probe retracted, no trial left
  done,
};
std::string_view to_string(Step step);

/// Longest pause and longest operator step; after it the campaign ends as stopped.
inline constexpr Duration longest_hold = std::chrono::hours(24);

/// The whole state of the machine.
struct State {
  Step step = Step::ready;
  Ticket ticket = 0;              ///< of the expected answers and of the timer
  std::size_t trial = 0;          ///< index into Plan::trials
  std::size_t leg = 0;            ///< index into the path of M, while sliding
  std::size_t first_trial = 0;    ///< from Start
  std::size_t operator_step = 0;  ///< index into the plan's steps: the next to check for the trial
  double rest_z_m = 0;            ///< z at which the weight alone acts, from this trial's touch
  bool stop_requested = false;
  bool pause_requested = false;
  bool ended_early = false;              ///< the stroke ended by EndSlide
  bool repeats = false;                  ///< the trial ended early for a pause and is repeated
  std::uint32_t rejected = 0;            ///< rejected attempts of the trial so far
  std::optional<Error> bad_attempt;      ///< reason for rejecting the current attempt
  std::optional<Outcome> trial_outcome;  ///< set when the trial ends early
  std::optional<Error> trial_error;
  std::optional<Outcome> campaign_outcome;  ///< set when the campaign ends after this trial
  std::optional<Error> first_error;
  std::size_t last_step = 0;  ///< index of the final step after the current one
  TimePoint last_until{};     ///< end of the budget for the final steps
  std::size_t completed = 0;  ///< trials that ended complete
  std::size_t failed = 0;     ///< trials with another outcome
};

struct Transition {
  State next;
  std::vector<Effect> effects;  ///< in order of execution
};

/// Total: a state ignores an event that it does not expect. After Start the machine ends in
/// Step::done in every case, and every step before it has a timer.
///
/// Only HaltRequested, its own timer and MotionLost interrupt a retract. Any other fault or guard
/// during it is recorded and ends the campaign afterwards. Each of them also ends the final steps.
/// They change the outcome of a campaign only when its clean-up failed: `cleanup` is then partial.
Transition step(const Plan& plan, const State& state, const Event& event, TimePoint now);

}  // namespace weft::recipes
