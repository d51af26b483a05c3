#include "daemon/service/run_model/operator_prompts.hpp"

namespace weft::daemon::runs {

void OperatorPrompts::on_plan(std::int64_t run, const std::optional<recipes::StepPrompt>& first) {
  entries_.erase(run);
  if (first) entries_[run] = {*first};
}

const OperatorPrompt* OperatorPrompts::on_step(std::int64_t run, RunState state,
                                               const RunStatusUpdate& moment,
                                               std::chrono::nanoseconds now) {
  if (state == RunState::awaiting_operator && moment.requested) {
    const auto& [ticket, prompt] = *moment.requested;
    OperatorPrompt& opened = entries_[run];
    opened = {prompt, "Q-" + std::to_string(++names_taken_), ticket, now};
    return &opened;
  }
  if (state == RunState::running) on_plan(run, moment.next_prompt);
  return nullptr;
}

void OperatorPrompts::on_state(std::int64_t run, RunState state) {
  if (state >= RunState::finishing) {
    entries_.erase(run);
  } else if (state > RunState::running && state != RunState::awaiting_operator) {
    const auto found = entries_.find(run);  // a held run opens its prompt again after it is resumed
    if (found == entries_.end()) return;
    const bool is_confirmed = state == RunState::resuming && !found->second.step.empty();
    if (is_confirmed)
      entries_.erase(found);
    else
      found->second = {found->second.prompt};
  }
}

const OperatorPrompt* OperatorPrompts::find(std::int64_t run) const {
  const auto found = entries_.find(run);
  return found == entries_.end() ? nullptr : &found->second;
}

recipes::Ticket OperatorPrompts::ticket(std::int64_t run) const {
  const OperatorPrompt* const prompt = find(run);
  return prompt == nullptr ? 0 : prompt->ticket;
}

Status OperatorPrompts::check(std::int64_t run, std::string_view step) const {
  const OperatorPrompt* const prompt = find(run);
  const std::string open = prompt == nullptr ? "" : prompt->step;
  if (open == step) return {};
  return fail({.code = Errc::wrong_state,
               .where = "/params/step",
               .what = "operator step no longer pending",
               .expected = open,
               .got = std::string(step),
               .hint = "Read the pending step with run.get (\"attention\")"});
}

}  // namespace weft::daemon::runs
