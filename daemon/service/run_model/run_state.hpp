#pragma once
// A run as clients see it: a pure machine over what people order and what the run's thread reports,
// and the facts of its end. Every state but the last has a deadline; one that passes climbs the
// ladder pause, stop, abort, halt. Source: docs/reference/run-verbs.md.

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/campaign/orders/run_orders.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::runs {

enum class RunState : std::uint8_t {
  queued,             ///< waits for the rig
  arming,             ///< devices open, stages home
  running,            ///< trials
  pausing,            ///< on the way to held
  held,               ///< between trials, the probe up
  awaiting_operator,  ///< likewise, until a person confirms what the recipe asks for
  resuming,           ///< on the way back to running
  finishing,          ///< stop was asked: the repetition under way is finished
  aborting,           ///< motion stops, the probe retracts
  halting,            ///< motion stops where it is
  ended,              ///< outcome, cleanup and rig say how
  interrupted,  ///< cut short by the daemon's death, or on its way on; waits for somebody's choice
};
inline constexpr std::array all_run_states{
    RunState::queued,   RunState::arming,    RunState::running,
    RunState::pausing,  RunState::held,      RunState::awaiting_operator,
    RunState::resuming, RunState::finishing, RunState::aborting,
    RunState::halting,  RunState::ended,     RunState::interrupted};
std::string_view to_string(RunState state);

/// What comes after the trials, in seconds, each at most.
struct LastTimes {
  double finally_s = 0;      ///< what is done finally, however the run ends
  double finally_cut_s = 0;  ///< the same where it is aborted or fails
  double retreat_s = 0;      ///< of the probe
};

/// How long a state may last. From the plan, in wall time of the bench's kind.
struct Deadlines {
  using Duration = std::chrono::nanoseconds;
  Duration arming, running, trial, finishing, held, aborting, halting;
  static Deadlines of(double forecast_s, double trial_s, const LastTimes& last = {});
};

struct RunStateMachine {
  using Clock = std::chrono::nanoseconds;
  RunState state = RunState::queued;
  Clock deadline = Clock::max();  ///< of the state; queued, ended and interrupted wait for people
};

/// What follows: the machine, and what the run's thread is to be told.
struct RunStep {
  RunStateMachine next;
  std::optional<Order> order = {};
  /// The run's thread does not answer any more: it counts as ended, with the rig unknown.
  bool lost = false;
};

/// Errors: wrong_state, naming the state and what it takes.
Result<RunStep> on_order(const RunStateMachine& run, const Deadlines& limits, Order order,
                         RunStateMachine::Clock now);
/// The run's thread has begun.
RunStep on_begun(const RunStateMachine& run, const Deadlines& limits, RunStateMachine::Clock now);
/// The engine is in this step.
RunStep on_step(const RunStateMachine& run, const Deadlines& limits, recipes::Step step,
                RunStateMachine::Clock now);
/// `can_resume`: it was to go on with what is on record, and there is something left.
RunStep on_ended(bool can_resume = false);
/// Time has passed.
RunStep on_time(const RunStateMachine& run, const Deadlines& limits, RunStateMachine::Clock now);

/// The text of an error; empty without one.
std::string format_error(const std::optional<Error>& error);

/// What became of a run; empty where that is not known.
struct RunFacts {
  std::string outcome = {}, cleanup = {}, rig_fact = {};  ///< the three facts, once it has ended
  std::string error = {};                                 ///< the first thing that went wrong
  std::string dataset_sha256 = {};
  /// Why its record was not concluded, whatever became of the bench.
  std::string dataset_error = {};
  /// Outcome and error of its newest turn at the bench; empty where it had none, or died in it.
  std::string bench_outcome = {}, bench_error = {};
  /// "held" or "missed", where an accuracy was asked of a simulated bench.
  std::string promise = {};
  friend bool operator==(const RunFacts&, const RunFacts&) = default;
};

/// How the thread of a run came to its end.
struct RunEnd {
  RunFacts found;  ///< by its summary or, without one, its error and its folder
  bool has_summary = false;
  bool acquired_rig = false;  ///< else the rig is as it was
  bool was_closing = false;   ///< the daemon's end gave the order
};
/// `former`: facts of its end before it was resumed, if it was.
RunFacts facts_of_end(const RunFacts& former, const RunEnd& end);
/// Of a run that does not obey in time. `certified`: the data set in its folder.
RunFacts facts_without_answer(RunFacts former, bool has_rig, std::string certified);

}  // namespace weft::daemon::runs
