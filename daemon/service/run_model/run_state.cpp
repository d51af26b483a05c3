#include "daemon/service/run_model/run_state.hpp"

#include <algorithm>
#include <array>

namespace weft::daemon::runs {
namespace {

using namespace std::chrono_literals;
using Clock = RunStateMachine::Clock;

struct StateRow {
  std::string_view name;
  Clock Deadlines::*length = nullptr;     ///< longest duration; null: waits for a person
  std::optional<Order> at_deadline = {};  ///< the next rung of the ladder
};
/// In the order of RunState.
constexpr std::array<StateRow, all_run_states.size()> rows{
    {{"queued"},
     {"arming", &Deadlines::arming, Order::abort},
     {"running", &Deadlines::running, Order::stop},
     {"pausing", &Deadlines::trial, Order::abort},
     {"held", &Deadlines::held, Order::stop},
     {"awaiting_operator", &Deadlines::held, Order::stop},
     {"resuming", &Deadlines::trial, Order::abort},
     {"finishing", &Deadlines::finishing, Order::abort},
     {"aborting", &Deadlines::aborting, Order::halt},
     {"halting", &Deadlines::halting},
     {"ended"},
     {"interrupted"}}};
static_assert(std::ranges::none_of(rows, [](const StateRow& row) { return row.name.empty(); }));

const StateRow& row_of(RunState state) {
  return rows[static_cast<std::size_t>(state)];
}

RunStep enter(RunState state, const Deadlines& limits, Clock now,
              std::optional<Order> order = std::nullopt) {
  const auto length = row_of(state).length;
  const bool is_limited = length != nullptr && limits.*length != Clock::max();
  return {{state, is_limited ? now + limits.*length : Clock::max()}, order, false};
}

/// The state after an order in `state`; empty if that state refuses it.
std::optional<RunState> after(RunState state, Order order) {
  using enum RunState;
  const auto from = [state](std::initializer_list<RunState> states, RunState next) {
    return std::ranges::count(states, state) > 0 ? std::optional(next) : std::nullopt;
  };
  switch (order) {
    case Order::pause:
    case Order::pause_now:
      return from({running, pausing, awaiting_operator}, pausing);
    case Order::resume:
      return from({held, pausing}, resuming);
    case Order::confirm:
      return from({awaiting_operator}, resuming);
    case Order::stop:
      return from({arming, running, pausing, held, awaiting_operator, resuming}, finishing);
    case Order::abort:
      return from({arming, running, pausing, held, awaiting_operator, resuming, finishing},
                  aborting);
    case Order::halt:
      return from(
          {arming, running, pausing, held, awaiting_operator, resuming, finishing, aborting},
          halting);
  }
  return std::nullopt;
}

std::string takes(RunState state) {
  std::string words;
  for (const Order order :
       {Order::pause, Order::resume, Order::confirm, Order::stop, Order::abort, Order::halt})
    if (after(state, order)) words += (words.empty() ? "" : ", ") + std::string(to_string(order));
  return words.empty() ? "none" : words;
}

/// A resumed run that did not acquire the rig moves nothing and has no clean-up.
bool ends_as_before(const RunFacts& former, bool had_rig) {
  return !had_rig && !former.outcome.empty();
}

}  // namespace

std::string format_error(const std::optional<Error>& error) {
  return error ? to_string(*error) : std::string();
}

std::string_view to_string(RunState state) {
  return row_of(state).name;
}

Deadlines Deadlines::of(double forecast_s, double trial_s, const LastTimes& last) {
  // 2^63 ns are 292 years, and a deadline is counted from now.
  const auto seconds = [](double s) {
    constexpr double longest_s = 100 * 365.25 * 86400;
    return std::chrono::duration_cast<Duration>(
        std::chrono::duration<double>(std::min(s, longest_s)));
  };
  return {.arming = 10min,
          .running = seconds(2 * forecast_s) + seconds(last.finally_s) + 10min,
          .trial = seconds(2 * trial_s) + 1min,
          .finishing = seconds(2 * trial_s) + seconds(last.finally_s) + 1min,
          .held = std::chrono::duration_cast<Duration>(recipes::longest_hold),
          .aborting = seconds(last.retreat_s) + seconds(last.finally_cut_s) + 2min,
          .halting = 10s};
}

Result<RunStep> on_order(const RunStateMachine& run, const Deadlines& limits, Order order,
                         Clock now) {
  if (const auto next = after(run.state, order)) return enter(*next, limits, now, order);
  return fail(
      {.code = Errc::wrong_state,
       .where = "run",
       .what = run.state == RunState::ended
                   ? std::string("run has ended, order not possible")
                   : "order not possible while the run is " + std::string(to_string(run.state)),
       .expected = run.state == RunState::ended ? std::string() : takes(run.state),
       .got = std::string(to_string(order))});
}

RunStep on_begun(const RunStateMachine& run, const Deadlines& limits, Clock now) {
  return run.state == RunState::queued ? enter(RunState::arming, limits, now) : RunStep{run};
}

RunStep on_step(const RunStateMachine& run, const Deadlines& limits, recipes::Step step,
                Clock now) {
  using enum RunState;
  const auto is_in = [&run](auto... states) { return ((run.state == states) || ...); };
  const bool is_held = step == recipes::Step::held;
  const bool prompts = step == recipes::Step::awaiting_operator;
  // A prompt that opens while the run pauses opens again after it is resumed.
  if (prompts && is_in(arming, running, held, awaiting_operator, resuming))
    return enter(awaiting_operator, limits, now);
  if (is_held && is_in(running, pausing)) return enter(held, limits, now);
  if (is_in(arming) || (!is_held && !prompts && is_in(held, awaiting_operator, resuming)))
    return enter(running, limits, now);
  return {run};
}

RunStep on_ended(bool can_resume) {
  return {{can_resume ? RunState::interrupted : RunState::ended, Clock::max()}};
}

RunStep on_time(const RunStateMachine& run, const Deadlines& limits, Clock now) {
  if (now < run.deadline || row_of(run.state).length == nullptr) return {run};
  const auto order = row_of(run.state).at_deadline;
  if (!order) return {{RunState::ended, Clock::max()}, {}, true};
  return enter(*after(run.state, *order), limits, now, order);
}

RunFacts facts_of_end(const RunFacts& former, const RunEnd& end) {
  RunFacts out = end.found;
  if (end.has_summary && end.was_closing && out.outcome == "aborted" && out.error.empty())
    out.error = daemon_stopped_error;
  if (ends_as_before(former, end.acquired_rig)) {
    out.cleanup = former.cleanup;
    if (!end.has_summary) out.dataset_error = former.dataset_error;
    // An order that ended the run is shown in any case.
    if (!end.has_summary && out.outcome == "failed") out.outcome = former.outcome;
  }
  out.bench_outcome = end.acquired_rig ? out.outcome : former.bench_outcome;
  out.bench_error = end.acquired_rig ? out.error : former.bench_error;
  if (end.acquired_rig || !end.has_summary || out.bench_outcome.empty()) return out;
  out.outcome = out.bench_outcome;  // only the record is finished now: the bench's end counts
  out.error = out.bench_error;
  return out;
}

RunFacts facts_without_answer(RunFacts former, bool has_rig, std::string certified) {
  if (!ends_as_before(former, has_rig)) {
    former.outcome = "failed";
    former.cleanup = "skipped";
    former.dataset_error.clear();
    former.dataset_sha256 = std::move(certified);
  }
  former.error = unresponsive_error;
  return former;
}

}  // namespace weft::daemon::runs
