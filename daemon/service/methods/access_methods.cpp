// Access: leases of the rig, open sessions and tokens. An operator at the bench can make a token
// for a browser without ending the daemon.

#include <functional>
#include <nlohmann/json.hpp>

#include "daemon/service/methods/helpers.hpp"
#include "daemon/service/rpc/session.hpp"

namespace weft::daemon::api {
namespace {

using access::Lease;
using std::chrono::milliseconds;

constexpr rpc::ParamSpec lease_param{"lease", ParamType::text, true,
                                     "id of the lease, \"L-9c1d40b2-7\""};
constexpr rpc::ParamSpec ttl_param{"ttl_ms", ParamType::integer, false,
                                   "time until it expires unless renewed [ms] (default: 15000)"};

json lease_json(const Services& services, const Lease& lease) {
  const auto left = lease.expires - services.now();
  return {{"lease", lease.id},
          {"scope", lease.scope},
          {"user", lease.user},
          {"session", lease.session},
          {"note", lease.note},
          {"expires_us", services.utc_us() + left.count() / 1000},
          {"kept_for", lease.kept_for.empty() ? json() : json(lease.kept_for)}};
}

/// Event of a topic "lease:SCOPE": the current holder, and the latest change of the lease. A
/// snapshot therefore contains exactly one of the changes.
json delta_of(std::string_view what, const json& lease, const json& held, std::string_view who) {
  json delta{{"held", held}, {"by", who}};
  for (const std::string_view each :
       {"acquired", "renewed", "released", "kept", "broken", "expired"})
    delta[std::string(each)] = each == what ? lease : json();
  return delta;
}

void notify(const Services& services, const Lease& lease, std::string_view what, json payload,
            std::string_view who) {
  payload["by"] = who;
  json held;
  for (const Lease& each : services.leases->all(services.now()))
    if (each.scope == lease.scope)
      held = each.id == lease.id ? payload : lease_json(services, each);
  services.hub->publish("lease:" + lease.scope, delta_of(what, payload, held, who),
                        services.utc_us());
}

/// Applies `change` to the leases once it is in the journal, then publishes it. `more` holds
/// further members of the reply. If the journal cannot be written, the leases stay unchanged.
Outcome changed(const Services& services, const Call& call, std::string_view what,
                const std::function<Result<Lease>(access::Leases&)>& change,
                const json& more = json::object()) {
  access::Leases after = *services.leases;
  const auto lease = change(after);
  if (!lease) return refused(lease.error());
  json reply = lease_json(services, *lease);
  reply.update(more);
  json payload = reply;
  payload["by"] = by(call.caller);
  const std::string kind = "lease." + std::string(what);
  if (const Status ok = append_journal(services, kind, by(call.caller), payload); !ok)
    return refused(ok.error());
  *services.leases = std::move(after);
  notify(services, *lease, what, reply, by(call.caller));
  return format_text(reply);
}

milliseconds read_ttl(const Call& call) {
  return milliseconds(call.params.value("ttl_ms", std::int64_t{15000}));
}

/// Journals a renewal only if it extends the journalled end by a second or more, so that frequent
/// renewals do not fill the journal. A full disk ends no lease.
Outcome renew(const Services& services, const Call& call) {
  const std::string id = call.params.at("lease").get<std::string>();
  const auto lease = services.leases->renew(id, call.caller.user, read_ttl(call), services.now());
  if (!lease) return refused(lease.error());
  const json reply = lease_json(services, *lease);
  if (services.leases->should_journal(id))
    services.log->persist({.journal = {{0, services.utc_us(), "", "lease.renewed", by(call.caller),
                                        format_text(reply)}}});
  notify(services, *lease, "renewed", reply, by(call.caller));
  return format_text(reply);
}

Outcome acquire(const Services& services, const Call& call) {
  const std::string rig = "rig:" + services.rig_name;
  if (const std::string scope = call.params.value("scope", rig); scope != rig)
    return refused({.code = Errc::not_found,
                    .where = "/params/scope",
                    .what = "unknown lease scope",
                    .expected = rig,
                    .got = scope,
                    .hint = "Omit it for this rig"});
  return changed(services, call, "acquired", [&](access::Leases& leases) {
    return leases.acquire(
        {rig, call.caller.user, call.caller.session, call.params.value("note", ""), read_ttl(call)},
        services.now());
  });
}

std::string lease_of(const Call& call) {
  return call.params.at("lease").get<std::string>();
}

Outcome release(const Services& services, const Call& call) {
  return changed(services, call, "released", [&](access::Leases& leases) {
    return leases.release(lease_of(call), call.caller.user, services.now());
  });
}

Outcome break_lease(const Services& services, const Call& call) {
  const std::string reason = call.params.at("reason").get<std::string>();
  const auto broken = [&](access::Leases& leases) {
    return leases.break_lease(lease_of(call), reason, services.now());
  };
  return changed(services, call, "broken", broken, {{"reason", reason}});
}

Outcome list_leases(const Services& services, const Call&) {
  json out = json::array();
  for (const Lease& lease : services.leases->all(services.now()))
    out.push_back(lease_json(services, lease));
  return format_text({{"leases", std::move(out)}});
}

Outcome list_sessions(const Services& services, const Call&) {
  json out = json::array();
  for (const auto& [name, client_session] : *services.sessions) {
    if (!client_session->is_open()) continue;
    const rpc::Caller& who = client_session->caller();
    out.push_back({{"session", name},
                   {"user", who.user},
                   {"client", who.client},
                   {"role", access::to_string(who.role)},
                   {"local", who.local},
                   {"subscriptions", client_session->subscriptions().size()},
                   {"waiting_calls", client_session->pending()}});
  }
  return format_text({{"sessions", std::move(out)}});
}

rpc::RpcError closed_by(const std::string& by, const std::string& reason) {
  return rpc::rpc_error(
      rpc::code::access + 8, "session.closed",
      {.code = Errc::wrong_state,
       .what = "session closed by " + by,
       .got = reason,
       .hint = "Open another session with session.open; started runs are not affected"});
}

/// A caller may close its own session; closing another user's requires the role admin.
Outcome close_session(const Services& services, const Call& call) {
  const std::string name = call.params.value("session", call.caller.session);
  const bool own = name == call.caller.session;
  if (!own && call.caller.role < Role::admin)
    return refused(rpc::code::access + 3, "access.role",
                   {.code = Errc::wrong_state,
                    .where = "/params/session",
                    .what = "session of another user",
                    .expected = "admin",
                    .got = std::string(access::to_string(call.caller.role)),
                    .hint = "Omit it to close your own session"});
  const auto found = services.sessions->find(name);
  if (found == services.sessions->end() || !found->second->is_open())
    return refused({.code = Errc::not_found,
                    .where = "/params/session",
                    .what = "unknown session",
                    .got = name,
                    .hint = "List the sessions with session.list"});
  const std::string reason = call.params.value("reason", "");
  if (!own && reason.size() < 3)
    return refused(
        bad_param("reason", "reason missing or too short", "at least 3 characters", reason));
  server::Session& session = *found->second;
  const json payload{{"session", name}, {"user", session.caller().user}, {"reason", reason}};
  if (const Status ok = append_journal(services, "session.closed", by(call.caller), payload); !ok)
    return refused(ok.error());
  session.end(closed_by(by(call.caller), reason));
  return format_text({{"closed", name}});
}

constexpr std::int64_t day_us = 86'400'000'000;
constexpr std::int64_t most_days = 3660;

Outcome add_token(const Services& services, const Call& call) {
  const std::string name = call.params.at("name").get<std::string>();
  const std::string wanted = call.params.value("role", "operator");
  const auto role = access::role_from(wanted);
  if (!role)
    return refused(
        bad_param("role", "unknown role", "observer, operator, engineer or admin", wanted));
  const auto days = read_whole_number(call, {"days", 30, 1, most_days, "days out of range"});
  if (!days) return refused(days.error());
  const std::int64_t expires_us = services.utc_us() + static_cast<std::int64_t>(*days) * day_us;
  const bool own = call.params.value("own", false);
  if (own && !call.caller.token.empty())  // it would outlive the caller's own token
    return refused({.code = Errc::wrong_state,
                    .where = "/params/own",
                    .what = "own token not available to a user of a token",
                    .expected = "a user of the machine, through the Unix socket",
                    .got = "the token " + call.caller.token,
                    .hint = "Omit it; the user of the new token is then token:NAME"});
  const std::string user = own ? call.caller.user : "";
  const auto token = services.add_token(name, *role, expires_us, user);
  if (!token && token.error().code == Errc::invalid_argument && token.error().where == "token")
    return refused(rpc::code::state + 13, "token.name_taken", token.error());
  if (!token) return refused(token.error());
  const json reply{{"name", name},
                   {"role", wanted},
                   {"expires_us", expires_us},
                   {"user", access::user_of({name, *role, {}, expires_us, user})}};
  if (const Status ok = append_journal(services, "token.added", by(call.caller), reply); !ok) {
    static_cast<void>(services.remove_token(name));  // the token was not yet returned to anyone
    return refused(ok.error());
  }
  json out = reply;
  out["token"] = *token;
  return format_text(out);
}

}  // namespace

tl::expected<void, rpc::RpcError> can_order(const Services& services, const Call& call, Order order,
                                            Role least_to_break) {
  const std::string run = run_of(call);
  const auto holder = services.leases->holder("rig:" + services.rig_name, services.now());
  if (holder && holder->user == call.caller.user) return {};
  auto lease = services.leases->kept_for(run);
  if (!lease) lease = holder;
  if (!lease || lease->user == call.caller.user) return {};
  const std::string reason = call.params.value("break_lease", "");
  if (reason.empty()) return lease_held(*lease, call.caller);
  if (call.caller.role < least_to_break)
    return refused(rpc::code::access + 3, "access.role",
                   {.code = Errc::wrong_state,
                    .where = "/params/break_lease",
                    .what = "role not permitted to break the lease for this order",
                    .expected = std::string(access::to_string(least_to_break)),
                    .got = std::string(access::to_string(call.caller.role))});
  const std::string step = call.params.value("step", "");
  if (!services.run_manager->check_order(run, order, step)) return {};  // refused: keep the lease
  const auto broken = changed(
      services, call, "broken",
      [&](access::Leases& leases) { return leases.break_lease(lease->id, reason, services.now()); },
      {{"reason", reason}, {"run", run}});
  if (!broken) return tl::unexpected(broken.error());
  return {};
}

void keep_lease(const Services& services, const runs::RunView& run) {
  const std::string id = run.stored.id();
  constexpr std::string_view who = "auto:run";
  if (run.is_over()) {
    const auto lease = services.leases->end_keeping(id, services.now());
    const bool is_over = lease && lease->expires <= services.now();
    if (is_over) notify(services, *lease, "released", lease_json(services, *lease), who);
  } else if (run.state() != runs::RunState::queued && !run.stored.user.empty()) {
    const access::Leases::Request owner{.scope = "rig:" + services.rig_name,
                                        .user = run.stored.user,
                                        .session = {},
                                        .note = run.stored.recipe.stem().string()};
    if (const auto lease = services.leases->keep(id, owner, services.now()))
      notify(services, *lease, "kept", lease_json(services, *lease), who);
  }
}

void notify_lease_expired(const Services& services, const Lease& lease) {
  constexpr std::string_view who = "auto:time";
  const json reply = lease_json(services, lease);
  services.log->persist({.journal = {{0, services.utc_us(), "", "lease.expired", std::string(who),
                                      format_text(reply)}}});
  notify(services, lease, "expired", reply, who);
}

void add_lease_methods(rpc::Methods& methods, const Services& services) {
  MethodGroup group(methods, services);
  group
      .change("lease.acquire", "acquire the lease of the rig for a limited time", Role::operator_,
              {{"scope", ParamType::text, false, "what to lease (default: this rig)"},
               ttl_param,
               {"note", ParamType::text, false, "purpose, shown to other users"}},
              "lease, expires_us", acquire)
      .memory = rpc::Memory::while_running;
  group
      .change("lease.renew", "extend a lease before it expires", Role::operator_,
              {lease_param, ttl_param}, "lease, expires_us", renew)
      .memory = rpc::Memory::while_running;
  group
      .change("lease.release", "release a lease", Role::operator_, {lease_param}, "the ended lease",
              release)
      .memory = rpc::Memory::while_running;
  group
      .change("lease.break", "break the lease of another user; all users are notified", Role::admin,
              {lease_param, {"reason", ParamType::text, true, "reason, at least 3 characters"}},
              "the ended lease, reason", break_lease)
      .memory = rpc::Memory::while_running;
  group.read("lease.list", "list the leases and their users", {}, "leases", list_leases);
}

void add_session_methods(rpc::Methods& methods, const Services& services) {
  MethodGroup group(methods, services);
  group.read("session.list", "list the connected clients with an open session", {},
             "sessions: session, user, client, role, local (through the Unix socket), "
             "subscriptions, waiting_calls",
             list_sessions);
  group.change(
      "session.close",
      "close a session after its answer is sent: your own, or as an admin another one with a "
      "reason. Started runs continue, and its leases last until they expire",
      Role::observer,
      {{"session", ParamType::text, false, "name of the session, \"s-41\" (default: your own)"},
       {"reason", ParamType::text, false,
        "reason, for the client and the journal; needed for the session of another user"}},
      "closed", close_session);
}

void add_token_methods(rpc::Methods& methods, const Services& services) {
  MethodGroup group(methods, services);
  group
      .change(
          "token.add", "create a token for TCP and HTTP; only this answer contains it", Role::admin,
          {{"name", ParamType::text, true, "name of the token, not yet in use"},
           {"role", ParamType::text, false,
            "role (default: operator; observer, operator, engineer, admin)"},
           {"days", ParamType::integer, false, "time until it expires [days] (default: 30)"},
           {"own", ParamType::flag, false,
            "create it for yourself, a user of the machine without a token: its client acts as you "
            "within its role, with your leases and idempotency keys. Otherwise its user is "
            "token:NAME"}},
          "name, role, expires_us, user (of the token), token", add_token)
      .memory = rpc::Memory::while_running;
}

}  // namespace weft::daemon::api
