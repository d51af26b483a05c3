// What runs ask people for, and what people answer.

#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/service/runs/desk_run.hpp"

namespace weft::daemon::control {

void RunDesk::moved(Run& run, const RunMoment& moment) {
  run.view.moment = moment;
  run.view.trials_planned = moment.planned;
  const RunStep step = on_step(run.view.machine, run.limits, moment.step, around_.now());
  const bool waits = step.next.state == RunState::awaiting_operator;
  const bool goes_on = waits || step.next.state == RunState::running;
  if (waits && moment.asked) ask(run, *moment.asked);
  if (!waits && goes_on) run.view.attention.reset();
  if (!waits && goes_on && moment.next_ask) {
    run.view.attention = Attention{*moment.next_ask, {}};
    if (moment.next_ask_in_s)
      run.view.attention->at =
          around_.now() + std::chrono::nanoseconds(std::llround(*moment.next_ask_in_s * 1e9));
  }
  apply(run, step, "auto:run");
}

void RunDesk::ask(Run& run, const recipes::AskOperator& asked) {
  run.asked = asked.ticket;
  run.view.attention = Attention{asked.ask, "Q-" + std::to_string(++asks_), around_.now()};
  const nlohmann::json payload{{"step", run.view.attention->step},
                               {"text", asked.ask.text},
                               {"trial", asked.ask.trial},
                               {"people_s", asked.ask.people_s}};
  note(run.view.stored.id(), "asked", by_recipe, payload.dump());
}

std::chrono::nanoseconds RunDesk::wall_ahead() const {
  const std::int64_t wall_us = around_.wall_us ? around_.wall_us() : around_.utc_us();
  return std::chrono::microseconds(wall_us) - around_.now();
}

// Whoever reads it looks at the machine's clock, which may have been set since the time was known.
void RunDesk::name_time(RunView& view) const {
  if (!view.attention || !view.attention->at) return;
  const auto utc = *view.attention->at + wall_ahead();
  view.attention->at_us = std::chrono::duration_cast<std::chrono::milliseconds>(utc).count() * 1000;
}

Result<RunView> RunDesk::confirm(std::string_view id, std::string_view step, std::string_view by) {
  Run* const run = find(id);
  if (run == nullptr)
    return fail({.code = Errc::not_found,
                 .where = "/params/run",
                 .what = "no such run",
                 .got = std::string(id)});
  const auto next = on_order(run->view.machine, run->limits, Order::confirm, around_.now());
  if (!next) return pass(next.error(), run->view.stored.id());
  const std::string asked = run->view.attention ? run->view.attention->step : "";
  if (asked != step)
    return fail({.code = Errc::wrong_state,
                 .where = "/params/step",
                 .what = "this is not what is asked for now",
                 .expected = asked,
                 .got = std::string(step),
                 .hint = "run.get tells what is asked, under \"attention\""});
  const nlohmann::json payload{{"step", asked}};
  note(run->view.stored.id(), "confirmed", by, payload.dump());
  apply(*run, *next, by);
  return shown(*run);
}

}  // namespace weft::daemon::control
