#include "daemon/service/run_model/operator_prompts.hpp"

#include <cmath>

namespace weft::daemon::runs {

bool update_prompt(NextPrompt& prompt, RunState state, const RunStatusUpdate& moment,
                   std::chrono::nanoseconds now, std::int64_t& names_taken) {
  if (state == RunState::awaiting_operator && moment.requested) {
    const auto& [ticket, requested] = *moment.requested;
    prompt = {requested, "Q-" + std::to_string(++names_taken), ticket, now};
    return true;
  }
  if (state != RunState::running) return false;
  prompt.reset();
  if (!moment.next_prompt) return false;
  prompt = {*moment.next_prompt};
  if (moment.next_prompt_in_s)
    prompt->at = now + std::chrono::nanoseconds(std::llround(*moment.next_prompt_in_s * 1e9));
  return false;
}

bool needs_people(RunState state) {
  return state < RunState::pausing || state == RunState::awaiting_operator;
}

Status check_confirmation(const NextPrompt& prompt, std::string_view step) {
  const std::string open = prompt ? prompt->step : "";
  if (open == step) return {};
  return fail({.code = Errc::wrong_state,
               .where = "/params/step",
               .what = "this is not what is asked for now",
               .expected = open,
               .got = std::string(step),
               .hint = "run.get tells what is asked, under \"attention\""});
}

}  // namespace weft::daemon::runs
