#pragma once
// What the operator steps of runs ask people for, and which of it is open: pure, with the time as
// an argument.

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/campaign/orders/run_orders.hpp"
#include "daemon/service/run_model/run_state.hpp"

namespace weft::daemon::runs {

/// What a person is asked for, or will be.
struct OperatorPrompt {
  recipes::StepPrompt prompt;
  std::string step = {};       ///< names what is asked now, "Q-12"; empty where it is not asked yet
  recipes::Ticket ticket = 0;  ///< what the engine needs with a confirmation; 0 likewise
  /// Since when, or when it will be as far as is known, by the monotonic clock.
  std::optional<std::chrono::nanoseconds> at = {};
  std::optional<std::int64_t> at_us = {};  ///< the same by the machine's wall clock [UTC]
};

/// The prompt of a run that is open, or the next one.
using NextPrompt = std::optional<OperatorPrompt>;

/// The engine of a run reports, which is in `state` from now on. True: a prompt opens. Its name is
/// a new one: `names_taken` of them have been given.
bool update_prompt(NextPrompt& prompt, RunState state, const RunStatusUpdate& moment,
                   std::chrono::nanoseconds now, std::int64_t& names_taken);
/// False: a run in this state is on its way to its end, or held.
bool needs_people(RunState state);
/// Errors: wrong_state, when `step` does not name the open prompt.
Status check_confirmation(const NextPrompt& prompt, std::string_view step);

}  // namespace weft::daemon::runs
