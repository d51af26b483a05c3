#pragma once
// A run as clients see it: a pure state machine over people's orders and the reports of the run's
// thread, and the facts of its end. Most states have a deadline; after it the ladder pause, stop,
// abort, halt is climbed. Source: docs/reference/run-states.md.

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
  arming,             ///< opens devices, homes stages
  running,            ///< executes trials
  pausing,            ///< on the way to held
  held,               ///< between trials, probe retracted
  awaiting_operator,  ///< as held, until a person confirms the operator step
  resuming,           ///< on the way back to running
  finishing,          ///< after a stop: the current repetition is finished
  aborting,           ///< motion stops, the probe retracts
  halting,            ///< motion stops in place
  ended,              ///< outcome, cleanup and rig are set
  interrupted,  ///< ended early by the daemon's death or in a resume; waits for a person's decision
};
inline constexpr std::array all_run_states{
    RunState::queued,   RunState::arming,    RunState::running,
    RunState::pausing,  RunState::held,      RunState::awaiting_operator,
    RunState::resuming, RunState::finishing, RunState::aborting,
    RunState::halting,  RunState::ended,     RunState::interrupted};
std::string_view to_string(RunState state);

/// Longest times of the phases after the trials [s].
struct LastTimes {
  double finally_s = 0;      ///< final steps, however the run ends
  double finally_cut_s = 0;  ///< final steps after an abort or a failure
  double retreat_s = 0;      ///< retraction of the probe
};

/// Longest duration of each state. From the plan, in wall time of the bench's kind.
struct Deadlines {
  using Duration = std::chrono::nanoseconds;
  Duration arming, running, trial, finishing, held, aborting, halting;
  static Deadlines of(double forecast_s, double trial_s, const LastTimes& last = {});
};

struct RunStateMachine {
  using Clock = std::chrono::nanoseconds;
  RunState state = RunState::queued;
  Clock deadline = Clock::max();  ///< of the state; queued, ended and interrupted have none
};

/// Result of an event: the next machine, and the order to the run's thread.
struct RunStep {
  RunStateMachine next;
  std::optional<Order> order = {};
  /// The run's thread no longer answers: the run counts as ended, with the rig unknown.
  bool lost = false;
};

/// Errors: wrong_state, with the state and the orders that it accepts.
Result<RunStep> on_order(const RunStateMachine& run, const Deadlines& limits, Order order,
                         RunStateMachine::Clock now);
/// Call when the run's thread has started.
RunStep on_begun(const RunStateMachine& run, const Deadlines& limits, RunStateMachine::Clock now);
/// Call when the engine has entered `step`.
RunStep on_step(const RunStateMachine& run, const Deadlines& limits, recipes::Step step,
                RunStateMachine::Clock now);
/// `can_resume`: the run was to continue its record, and trials or the data set are left.
RunStep on_ended(bool can_resume = false);
/// Call when time has passed.
RunStep on_time(const RunStateMachine& run, const Deadlines& limits, RunStateMachine::Clock now);

/// Errors of runs that the daemon ended.
inline constexpr const char *daemon_stopped_error = "aborted because the daemon was stopped",
                            *unresponsive_error = "run unresponsive";

/// Text of an error; empty without one.
std::string format_error(const std::optional<Error>& error);

/// Result of a run; a field is empty if not known.
struct RunFacts {
  std::string outcome = {}, cleanup = {}, rig_fact = {};  ///< the three facts, once it has ended
  std::string error = {};                                 ///< the first error
  std::string dataset_sha256 = {};
  /// Why its record could not be finished, whatever the outcome.
  std::string dataset_error = {};
  /// Outcome and error of its newest execution on the bench; empty if there was none, or if the
  /// daemon died in it.
  std::string bench_outcome = {}, bench_error = {};
  /// "held" or "missed", if an accuracy was requested of a simulated bench.
  std::string promise = {};
  friend bool operator==(const RunFacts&, const RunFacts&) = default;
};

/// How the thread of a run ended.
struct RunEnd {
  RunFacts found;  ///< from its summary or, without one, its error and its folder
  bool has_summary = false;
  bool acquired_rig = false;  ///< otherwise the rig is unchanged
  bool was_closing = false;   ///< aborted because the daemon ended
};
/// `former`: facts of its end before it was resumed, if it was.
RunFacts facts_of_end(const RunFacts& former, const RunEnd& end);
/// Facts of a run that does not obey in time. `certified`: digest of the data set in its folder.
RunFacts facts_without_answer(RunFacts former, bool has_rig, std::string certified);

}  // namespace weft::daemon::runs
