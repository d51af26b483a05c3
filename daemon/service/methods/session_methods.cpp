// Who talks to the daemon now, and the end of a session by somebody's word.

#include <nlohmann/json.hpp>

#include "daemon/service/methods/helpers.hpp"
#include "daemon/service/rpc/session.hpp"

namespace weft::daemon::api {
namespace {

using nlohmann::json;
using rpc::Call;
using rpc::Outcome;
using rpc::ParamType;

Outcome list_sessions(const server::Sessions& sessions) {
  json out = json::array();
  for (const auto& [name, client_session] : sessions.all()) {
    if (!client_session->is_open()) continue;
    const rpc::Caller& who = client_session->caller();
    out.push_back({{"session", name},
                   {"user", who.user},
                   {"client", who.client},
                   {"role", access::to_string(who.role)},
                   {"local", who.local},
                   {"subscriptions", client_session->subscriptions()},
                   {"waiting_calls", client_session->pending()}});
  }
  return format_text({{"sessions", std::move(out)}});
}

rpc::RpcError closed_by(const std::string& by, const std::string& reason) {
  return rpc::rpc_error(rpc::code::access + 8, "session.closed",
                        {.code = Errc::wrong_state,
                         .what = "this session was closed by " + by,
                         .got = reason,
                         .hint = "What it has started goes on; session.open begins another"});
}

/// Whoever closes his own needs no more; what others said and ask for ends by an admin's word only.
Outcome closed(const Services& services, const Call& call) {
  const std::string name = call.params.value("session", call.caller.session);
  const bool own = name == call.caller.session;
  if (!own && call.caller.role < access::Role::admin)
    return tl::unexpected(rpc::rpc_error(rpc::code::access + 3, "access.role",
                                         {.code = Errc::wrong_state,
                                          .where = "/params/session",
                                          .what = "another's session",
                                          .expected = "admin",
                                          .got = std::string(access::to_string(call.caller.role)),
                                          .hint = "Leave it out to close your own"}));
  server::Session* const client_session = services.sessions->find(name);
  if (client_session == nullptr || !client_session->is_open())
    return refused({.code = Errc::not_found,
                    .where = "/params/session",
                    .what = "no such session",
                    .got = name,
                    .hint = "session.list tells who is there"});
  const std::string reason = call.params.value("reason", "");
  if (!own && reason.size() < 3)
    return refused({.code = Errc::invalid_argument,
                    .where = "/params/reason",
                    .what = "another's session is closed for a reason",
                    .expected = "a few words",
                    .got = reason});
  const json payload{
      {"session", name}, {"user", client_session->caller().user}, {"reason", reason}};
  if (const Status ok = services.log->append_journal(services.utc_us(), "", "session.closed",
                                                     by(call.caller), format_text(payload));
      !ok)
    return refused(ok.error());
  client_session->end(closed_by(by(call.caller), reason));
  return format_text({{"closed", name}});
}

}  // namespace

void add_session_methods(rpc::Methods& methods, const Services& services) {
  const Services* const s = &services;
  methods.add({"session.list",
               "who is connected and has introduced himself",
               {},
               {},
               {},
               "sessions: session, user, client, role, local (through the Unix socket), "
               "subscriptions, waiting_calls"},
              [s](const Call&) { return list_sessions(*s->sessions); });
  methods.add({"session.close",
               "ends a session once its answer is sent: your own, or an admin another's with a "
               "reason; what it has started goes on, and its leases until their time is over",
               access::Role::observer,
               rpc::Effect::change,
               {{"session", ParamType::text, false, "its name, \"s-41\"; yours"},
                {"reason", ParamType::text, false, "for who is there and for the journal"}},
               "closed"},
              [s](const Call& call) { return closed(*s, call); });
}

}  // namespace weft::daemon::api
