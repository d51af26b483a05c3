// How the rig stands: halted, latched, and reset by somebody who has looked at it.

#include <nlohmann/json.hpp>

#include "daemon/service/runs/desk_run.hpp"

namespace weft::daemon::control {

using nlohmann::json;

void RunDesk::stand(const RigStanding& standing, std::string_view by) {
  trusted_.clear();  // it was for how the rig stood then
  const bool is_same = standing == standing_;
  if (is_same && standing.fact != RigStanding::Fact::latched) return;
  standing_ = standing;  // every halt is told
  if (!is_same) keep_standing();
  if (around_.stands) around_.stands(standing_, by);
}

void RunDesk::halt(std::string_view by, std::string_view reason) {
  latch("halt", by, reason, standing_.emergency);
}

void RunDesk::emergency_stop(std::string_view by, std::string_view reason) {
  latch("estop", by, reason, true);
}

void RunDesk::latch(std::string_view kind, std::string_view by, std::string_view reason,
                    bool emergency) {
  bool is_news = standing_.fact != RigStanding::Fact::latched || standing_.emergency != emergency;
  for (const auto& run : runs_) {  // motion first, then what has to reach the disk
    const auto step = on_order(run->view.machine, run->limits, Order::halt, around_.now());
    if (!step) continue;
    is_news = is_news || step->next.state != run->state();
    apply(*run, *step, by);
  }
  std::string why(by);
  if (!reason.empty()) why.append(": ").append(reason);
  stand({RigStanding::Fact::latched, std::move(why), emergency}, by);
  note_stop({std::string(kind), std::string(by), std::string(reason)}, is_news);
}

void RunDesk::note_stop(const RepeatedStops::Stop& stop, bool is_news) {
  if (!repeated_stops_.is_line(stop, is_news, around_.now())) return;
  const json payload = stop.reason.empty() ? json::object() : json{{"reason", stop.reason}};
  note("", stop.kind, stop.by, payload.dump(-1, ' ', false, json::error_handler_t::replace));
}

void RunDesk::note_repeated(const std::vector<RepeatedStops::Counted>& counted) {
  for (const auto& [stop, times] : counted) {
    json payload{{"repeated", times}};
    if (!stop.reason.empty()) payload["reason"] = stop.reason;
    note("", stop.kind, stop.by, payload.dump(-1, ' ', false, json::error_handler_t::replace));
  }
}

Status RunDesk::reset(std::string_view reason, std::string_view by) {
  if (Status more = takes_more(); !more) return more;
  if (standing_.fact == RigStanding::Fact::safe)
    return fail({.code = Errc::wrong_state,
                 .where = "rig",
                 .what = "the rig is neither latched nor unknown"});
  if (reason.size() < 3)
    return fail({.code = Errc::invalid_argument,
                 .where = "/params/reason",
                 .what = "a reset needs a reason",
                 .expected = "a few words",
                 .got = std::string(reason)});
  if (const auto run = active())
    return fail({.code = Errc::wrong_state,
                 .where = *run,
                 .what = "a run has not ended yet",
                 .expected = "ended",
                 .hint = "Wait for it; one that does not answer ends with the daemon"});
  note_repeated(repeated_stops_.all());
  const std::string payload =
      json{{"reason", reason}}.dump(-1, ' ', false, json::error_handler_t::replace);
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
