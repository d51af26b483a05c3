#include "daemon/service/run_model/run_state.hpp"

#include <algorithm>
#include <array>

namespace weft::daemon::runs {
namespace {

using namespace std::chrono_literals;
using Clock = RunStateMachine::Clock;

constexpr std::array<std::string_view, 12> names{
    "queued",   "arming",    "running",  "pausing", "held",  "awaiting_operator",
    "resuming", "finishing", "aborting", "halting", "ended", "interrupted"};
static_assert(names.size() == all_run_states.size());

Clock lasting(const Deadlines& limits, RunState state) {
  switch (state) {
    case RunState::arming:
      return limits.arming;
    case RunState::running:
      return limits.running;
    case RunState::pausing:
    case RunState::resuming:
      return limits.trial;
    case RunState::finishing:
      return limits.finishing;
    case RunState::held:
    case RunState::awaiting_operator:
      return limits.held;
    case RunState::aborting:
      return limits.aborting;
    case RunState::halting:
      return limits.halting;
    case RunState::queued:
    case RunState::ended:
    case RunState::interrupted:
      break;
  }
  return Clock::max();
}

RunStep enter(RunState state, const Deadlines& limits, Clock now,
              std::optional<Order> order = std::nullopt) {
  const Clock length = lasting(limits, state);
  return {{state, length == Clock::max() ? length : now + length}, order, false};
}

/// Whether a state takes an order, and where that leads.
std::optional<RunState> after(RunState state, Order order) {
  const bool continues_running = state == RunState::running || state == RunState::pausing ||
                                 state == RunState::held || state == RunState::awaiting_operator ||
                                 state == RunState::resuming;
  switch (order) {
    case Order::pause:
    case Order::pause_now:
      if (state == RunState::running || state == RunState::pausing ||
          state == RunState::awaiting_operator)
        return RunState::pausing;
      return std::nullopt;
    case Order::resume:
      if (state == RunState::held || state == RunState::pausing) return RunState::resuming;
      return std::nullopt;
    case Order::confirm:
      if (state == RunState::awaiting_operator) return RunState::resuming;
      return std::nullopt;
    case Order::stop:
      if (continues_running || state == RunState::arming) return RunState::finishing;
      return std::nullopt;
    case Order::abort:
      if (continues_running || state == RunState::arming || state == RunState::finishing)
        return RunState::aborting;
      return std::nullopt;
    case Order::halt:
      if (continues_running || state == RunState::arming || state == RunState::finishing ||
          state == RunState::aborting)
        return RunState::halting;
      return std::nullopt;
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

}  // namespace

std::string_view to_string(RunState state) {
  return names[static_cast<std::size_t>(state)];
}

Deadlines Deadlines::of(double forecast_s, double trial_s, const LastTimes& last) {
  // Nanoseconds end after 292 years, and a deadline is counted from now.
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
  return fail({.code = Errc::wrong_state,
               .where = "run",
               .what = "a run that is " + std::string(to_string(run.state)) + " takes no " +
                       std::string(to_string(order)),
               .expected = takes(run.state),
               .got = std::string(to_string(order))});
}

RunStep on_begun(const RunStateMachine& run, const Deadlines& limits, Clock now) {
  return run.state == RunState::queued ? enter(RunState::arming, limits, now)
                                       : RunStep{run, {}, {}};
}

RunStep on_step(const RunStateMachine& run, const Deadlines& limits, recipes::Step step,
                Clock now) {
  const bool is_held = step == recipes::Step::held;
  const bool prompts = step == recipes::Step::awaiting_operator;
  switch (run.state) {
    case RunState::arming:
      return enter(prompts ? RunState::awaiting_operator : RunState::running, limits, now);
    case RunState::running:
      if (prompts) return enter(RunState::awaiting_operator, limits, now);
      [[fallthrough]];
    case RunState::pausing:  // what is asked meanwhile is asked again when it goes on
      if (is_held) return enter(RunState::held, limits, now);
      break;
    case RunState::held:
    case RunState::awaiting_operator:
    case RunState::resuming:
      if (prompts) return enter(RunState::awaiting_operator, limits, now);
      if (!is_held) return enter(RunState::running, limits, now);
      break;
    default:
      break;
  }
  return {run, {}, {}};
}

RunStep on_ended(bool can_resume) {
  return {{can_resume ? RunState::interrupted : RunState::ended, Clock::max()}, {}, {}};
}

RunStep on_time(const RunStateMachine& run, const Deadlines& limits, Clock now) {
  if (now < run.deadline) return {run, {}, {}};
  switch (run.state) {
    case RunState::running:
    case RunState::held:
    case RunState::awaiting_operator:
      return enter(RunState::finishing, limits, now, Order::stop);
    case RunState::arming:
    case RunState::pausing:
    case RunState::resuming:
    case RunState::finishing:
      return enter(RunState::aborting, limits, now, Order::abort);
    case RunState::aborting:
      return enter(RunState::halting, limits, now, Order::halt);
    case RunState::halting:
      return {{RunState::ended, Clock::max()}, {}, true};
    case RunState::queued:
    case RunState::ended:
    case RunState::interrupted:
      break;
  }
  return {run, {}, {}};
}

}  // namespace weft::daemon::runs
