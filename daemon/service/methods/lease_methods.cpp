#include <functional>
#include <nlohmann/json.hpp>

#include "daemon/service/methods/helpers.hpp"

namespace weft::daemon::api {
namespace {

using access::Lease;
using access::Role;
using nlohmann::json;
using rpc::Call;
using rpc::Effect;
using rpc::Outcome;
using rpc::ParamType;
using std::chrono::milliseconds;

constexpr rpc::ParamSpec lease_param{"lease", ParamType::text, true, "its name, \"L-9c1d40b2-7\""};
constexpr rpc::ParamSpec ttl_param{"ttl_ms", ParamType::integer, false,
                                   "how long it lasts without renewal [ms], 15000"};

json lease_json(const Services& services, const Lease& lease) {
  const auto left = lease.expires - services.now();
  return {{"lease", lease.id},  {"scope", lease.scope},
          {"user", lease.user}, {"session", lease.session},
          {"note", lease.note}, {"expires_us", services.utc_us() + left.count() / 1000}};
}

/// What a topic "lease:SCOPE" tells: who holds it now, and what has just been done with the lease,
/// so that one of these is there in a snapshot and the others are not.
json delta_of(std::string_view what, const json& lease, bool is_held, std::string_view who) {
  json delta{{"held", is_held ? lease : json()}, {"by", who}};
  for (const std::string_view each : {"acquired", "renewed", "released", "broken", "expired"})
    delta[std::string(each)] = each == what ? lease : json();
  return delta;
}

void notify(const Services& services, const Lease& lease, std::string_view what, json payload,
            std::string_view who) {
  payload["by"] = who;
  const bool is_held = what == "acquired" || what == "renewed";
  services.hub->publish("lease:" + lease.scope, delta_of(what, payload, is_held, who),
                        services.utc_us());
}

/// What `change` does with the leases is told once it is in the journal, with what people are to
/// know of it in `more`; where it cannot be kept they stay as they were.
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
  if (const Status ok =
          services.log->append_journal(services.utc_us(), "", "lease." + std::string(what),
                                       by(call.caller), format_text(payload));
      !ok)
    return refused(ok.error());
  *services.leases = std::move(after);
  notify(services, *lease, what, reply, by(call.caller));
  return format_text(reply);
}

/// In the journal where it adds a second or more to what is there: who renews without end does not
/// fill it. A disk that is full takes nobody's lease away.
Outcome renew(const Services& services, const Call& call, std::chrono::milliseconds ttl) {
  const std::string id = call.params.at("lease").get<std::string>();
  const auto lease = services.leases->renew(id, call.caller.user, ttl, services.now());
  if (!lease) return refused(lease.error());
  const json reply = lease_json(services, *lease);
  if (services.leases->should_journal(id))
    services.log->persist({.journal = {{0, services.utc_us(), "", "lease.renewed", by(call.caller),
                                        format_text(reply)}}});
  notify(services, *lease, "renewed", reply, by(call.caller));
  return format_text(reply);
}

milliseconds read_ttl(const Call& call) {
  return milliseconds(call.params.value("ttl_ms", std::int64_t{15000}));
}

Outcome acquire(const Services& services, const Call& call) {
  const std::string rig = "rig:" + services.rig_name;
  if (const std::string scope = call.params.value("scope", rig); scope != rig)
    return refused({.code = Errc::not_found,
                    .where = "/params/scope",
                    .what = "nothing of that name is leased here",
                    .expected = rig,
                    .got = scope,
                    .hint = "Leave it out for this rig"});
  return changed(services, call, "acquired", [&](access::Leases& leases) {
    return leases.acquire(
        {rig, call.caller.user, call.caller.session, call.params.value("note", ""), read_ttl(call)},
        services.now());
  });
}

Outcome list_leases(const Services& services) {
  json out = json::array();
  for (const Lease& lease : services.leases->all(services.now()))
    out.push_back(lease_json(services, lease));
  return format_text({{"leases", std::move(out)}});
}

}  // namespace

void notify_lease_expired(const Services& services, const Lease& lease) {
  constexpr std::string_view who = "auto:time";
  const json reply = lease_json(services, lease);
  services.log->persist({.journal = {{0, services.utc_us(), "", "lease.expired", std::string(who),
                                      format_text(reply)}}});
  notify(services, lease, "expired", reply, who);
}

void add_lease_methods(rpc::Methods& methods, const Services& services) {
  const Services* const s = &services;
  const auto id_of = [](const Call& call) { return call.params.at("lease").get<std::string>(); };
  methods.add({"lease.acquire",
               "takes the rig for yourself, for a while",
               Role::operator_,
               Effect::change,
               {{"scope", ParamType::text, false, "this rig, where it is left out"},
                ttl_param,
                {"note", ParamType::text, false, "for the others, what for"}},
               "lease, expires_us",
               rpc::Memory::while_running},
              [s](const Call& call) { return acquire(*s, call); });
  methods.add({"lease.renew",
               "for longer",
               Role::operator_,
               Effect::change,
               {lease_param, ttl_param},
               "lease, expires_us",
               rpc::Memory::while_running},
              [s](const Call& call) { return renew(*s, call, read_ttl(call)); });
  methods.add({"lease.release",
               "done with it",
               Role::operator_,
               Effect::change,
               {lease_param},
               "the lease that is over",
               rpc::Memory::while_running},
              [s, id_of](const Call& call) {
                return changed(*s, call, "released", [&](access::Leases& leases) {
                  return leases.release(id_of(call), call.caller.user, s->now());
                });
              });
  methods.add({"lease.break",
               "takes it away from whoever holds it; told to all",
               Role::admin,
               Effect::change,
               {lease_param, {"reason", ParamType::text, true, "a few words"}},
               "the lease that is over, reason",
               rpc::Memory::while_running},
              [s, id_of](const Call& call) {
                const std::string reason = call.params.at("reason").get<std::string>();
                const auto broken = [&](access::Leases& leases) {
                  return leases.break_lease(id_of(call), reason, s->now());
                };
                return changed(*s, call, "broken", broken, {{"reason", reason}});
              });
  methods.add({"lease.list", "who holds what", {}, {}, {}, "leases"},
              [s](const Call&) { return list_leases(*s); });
}

}  // namespace weft::daemon::api
