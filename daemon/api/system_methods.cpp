#include <nlohmann/json.hpp>

#include "daemon/api/parts.hpp"
#include "daemon/recorder/recorder.hpp"
#include "daemon/server/conversation.hpp"
#include "recipes/engine/rig_limits.hpp"

namespace weft::daemon::api {
namespace {

using nlohmann::json;
using rpc::Call;
using rpc::Outcome;

json system_info(const Services& services) {
  return {{"product", "weftd"},
          {"version", WEFT_VERSION},
          {"protocol", server::protocol_version},
          {"epoch", services.epoch},
          {"rig", services.rig_name},
          {"listeners", services.hub->listeners()},
          {"seq", services.hub->seq()}};
}

json whoami(const rpc::Caller& caller) {
  return {{"session", caller.session},
          {"client", caller.client},
          {"user", caller.user},
          {"role", access::to_string(caller.role)},
          {"local", caller.local}};
}

json blocker(std::string_view kind, std::string where, std::string hint) {
  return {{"kind", kind}, {"where", std::move(where)}, {"hint", std::move(hint)}};
}

void add_standing_blocker(const control::RigStanding& standing, json& blockers) {
  using Fact = control::RigStanding::Fact;
  if (standing.fact == Fact::latched)
    blockers.push_back(blocker("rig.latched", "rig",
                               "Halted by " + standing.why + ": look at the rig, then rig.reset"));
  if (standing.fact == Fact::unknown)
    blockers.push_back(blocker("rig.unknown", standing.why,
                               "Nobody knows where that run left the rig: look at it, then "
                               "rig.reset, or go on with the run where it was interrupted"));
}

void add_rig_file_blocker(const Services& services, json& blockers) {
  const auto text = read_text_file(services.rig);
  if (!text)
    return blockers.push_back(
        blocker("rig.unreadable", services.rig.string(), to_string(text.error())));
  if (const auto limits = recipes::parse_rig_limits(*text); !limits)
    blockers.push_back(blocker("rig.invalid", services.rig.string(), to_string(limits.error())));
}

Outcome log_tail(const Services& services, const Call& call) {
  const std::int64_t most = call.params.value("most", std::int64_t{100});
  if (most < 1 || most > 10000)
    return refused(
        {Errc::range, "too many lines", "/params/most", "1 to 10000", std::to_string(most), {}});
  const auto lines =
      services.log->tail(call.params.value("run", ""), static_cast<std::size_t>(most));
  if (!lines) return refused(lines.error());
  json out = json::array();
  for (const auto& line : *lines)
    out.push_back({{"sequence", line.sequence},
                   {"t_us", line.utc_us},
                   {"run", line.run},
                   {"kind", line.kind},
                   {"by", line.by},
                   {"data", json::parse(line.payload_json, nullptr, false)}});
  return text_of({{"lines", std::move(out)}});
}

}  // namespace

std::string readiness_json(const Services& services) {
  json blockers = json::array();
  add_rig_file_blocker(services, blockers);
  add_standing_blocker(services.desk->standing(), blockers);
  if (!services.desk->standing_is_kept())
    blockers.push_back(blocker("storage.io", services.data.string(),
                               "How the rig stands could not be written down: see that the disk "
                               "has room; it is tried again"));
  if (const control::RunLine& line = services.desk->line(); line.held())
    blockers.push_back(blocker("queue.paused", "queue",
                               "Paused by " + line.held_by + ": queue.start lets the next begin"));
  if (const auto run = services.desk->active())
    blockers.push_back(blocker("rig.busy", *run, "Wait for it, or put yours in the queue"));
  if (const Status space = check_space(services.data, std::uint64_t{1} << 28); !space)
    blockers.push_back(blocker("disk.low", services.data.string(), to_string(space.error())));
  const bool ok = blockers.empty();
  return text_of({{"ok", ok}, {"blockers", std::move(blockers)}});
}

void add_system_methods(rpc::Methods& methods, const Services& services) {
  const Services* const s = &services;
  methods.add({"system.info", "what runs here", {}, {}, {}, "product, version, rig, epoch, seq"},
              [s](const Call&) -> Outcome { return text_of(system_info(*s)); });
  methods.add({"system.ready",
               "whether a run can be started, and all that keeps it from that",
               {},
               {},
               {},
               "ok, blockers"},
              [s](const Call&) -> Outcome { return readiness_json(*s); });
  methods.add({"system.time", "both clocks", {}, {}, {}, "t_us (UTC), mono_us"},
              [s](const Call&) -> Outcome {
                return text_of({{"t_us", s->utc_us()}, {"mono_us", s->now().count() / 1000}});
              });
  methods.add({"session.whoami", "who you are here", {}, {}, {}, "session, client, user, role"},
              [](const Call& call) -> Outcome { return text_of(whoami(call.caller)); });
  methods.add({"log.tail",
               "the newest lines of the daemon's journal",
               {},
               {},
               {{"run", rpc::ParamType::text, false, "of this run only"},
                {"most", rpc::ParamType::integer, false, "lines, 100"}},
               "lines: sequence, t_us, run, kind, by, data"},
              [s](const Call& call) { return log_tail(*s, call); });
  rpc::Methods* const all = &methods;
  methods.add({"rpc.discover", "this document", {}, {}, {}, "OpenRPC"},
              [all](const Call&) -> Outcome {
                return all->open_rpc(std::string(server::protocol_version) + ".0");
              });
}

}  // namespace weft::daemon::api
