// How the rig stands: halted, latched, and reset by somebody who has looked at it.

#include <nlohmann/json.hpp>

#include "daemon/control/desk_run.hpp"

namespace weft::daemon::control {

using nlohmann::json;

void RunDesk::stand(const RigStanding& standing, std::string_view by) {
  trusted_.clear();  // it was for how the rig stood then
  if (standing == standing_ && standing.fact != RigStanding::Fact::latched) return;
  standing_ = standing;  // every halt is told
  keep_standing();
  if (around_.stands) around_.stands(standing_, by);
}

void RunDesk::halt(std::string_view by) {
  latch(by, standing_.emergency);
  note("", "halt", by);
}

void RunDesk::emergency_stop(std::string_view by) {
  latch(by, true);
  note("", "estop", by);
}

void RunDesk::latch(std::string_view by, bool emergency) {
  for (const auto& run : runs_) {  // motion first, then what has to reach the disk
    const auto step = on_order(run->view.machine, run->limits, Order::halt, around_.now());
    if (step) apply(*run, *step, by);
  }
  stand({RigStanding::Fact::latched, std::string(by), emergency}, by);
}

Status RunDesk::reset(std::string_view reason, std::string_view by) {
  if (standing_.fact == RigStanding::Fact::safe)
    return fail(Errc::wrong_state, "the rig is neither latched nor unknown", "rig");
  if (reason.size() < 3)
    return fail(Errc::invalid_argument, "a reset needs a reason", "/params/reason", "a few words",
                std::string(reason));
  if (const auto run = active())
    return fail(Errc::wrong_state, "a run has not ended yet", *run, "ended", {},
                "Wait for it; one that does not answer ends with the daemon");
  const std::string payload = json{{"reason", reason}}.dump();
  const Status kept = store_.together([&] {
    Status done = store_.keep(RigStanding{});
    return done ? store_.journal(around_.utc_us(), "", "reset", by, payload) : done;
  });
  if (!kept) return kept;
  stand({}, by);
  if (line_.held_by == after_restart) static_cast<void>(start_line(by));
  begin_next();
  return {};
}

}  // namespace weft::daemon::control
