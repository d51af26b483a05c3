#include <nlohmann/json.hpp>

#include "daemon/service/methods/helpers.hpp"
#include "daemon/service/methods/rig_delta.hpp"

namespace weft::daemon::api {
namespace {

using access::Role;
using nlohmann::json;
using rpc::Call;
using rpc::Effect;
using rpc::Outcome;
using rpc::ParamType;
using runs::RunState;

/// Of a rig that a run has.
std::string_view fact_of(RunState state) {
  const bool is_waiting = state == RunState::held || state == RunState::awaiting_operator;
  return is_waiting ? "holding" : "moving";
}

/// Why it does not stand safe.
void add_reason(const runs::RigState& rig, json& out) {
  using Fact = runs::RigState::Fact;
  if (rig.fact() == Fact::latched) {
    out["latch"] = rig.is_emergency() ? "estop" : "halt";
    out["latched_by"] = rig.why();
  }
  if (rig.fact() == Fact::unknown) out["left_by"] = rig.why();
}

json rig_json(const runs::RunManager& manager) {
  using Fact = runs::RigState::Fact;
  const runs::RigState& rig = manager.rig_state();
  const auto run = manager.active();
  const bool moves = run && rig.fact() != Fact::latched;
  json out{{"rig", moves ? fact_of(manager.get(*run)->machine.state) : to_string(rig.fact())}};
  if (run) out["run"] = *run;
  add_reason(rig, out);
  return out;
}

Outcome latched(bool emergency) {
  return format_text({{"latched", true}, {"latch", emergency ? "estop" : "halt"}});
}

void add_stop(rpc::Methods& methods, std::string_view name, std::string_view summary,
              rpc::DirectHandler handler) {
  methods.add({name,
               summary,
               Role::observer,
               Effect::change,
               {{"reason", ParamType::text, false, "a few words, for whoever resets it"}},
               "latched, latch, warnings (what was wrong with the request, which was heeded all "
               "the same; only where there is some)",
               rpc::Memory::while_running,
               rpc::Urgency::stop},
              std::move(handler));
}

/// An emergency stop is released by who may change the rig, not by who runs recipes on it.
Outcome reset(const Services& services, const Call& call) {
  if (auto free = require_free_lease(services, call.caller); !free)
    return tl::unexpected(free.error());
  if (services.run_manager->rig_state().is_emergency() && call.caller.role < Role::engineer)
    return tl::unexpected(
        rpc::rpc_error(rpc::code::access + 3, "access.role",
                       {.code = Errc::wrong_state,
                        .where = "rig.reset",
                        .what = "an emergency stop is not released by an operator",
                        .expected = std::string(access::to_string(Role::engineer)),
                        .got = std::string(access::to_string(call.caller.role)),
                        .hint = "An engineer looks at the rig, then resets it"}));
  const std::string reason = call.params.at("reason").get<std::string>();
  if (const Status ok = services.run_manager->reset(reason, by(call.caller)); !ok)
    return refused(ok.error());
  return format_text({{"latched", false}});
}

}  // namespace

json rig_delta(const runs::RigState& rig, std::string_view by) {
  json delta{{"rig", to_string(rig.fact())},
             {"latch", nullptr},
             {"latched_by", nullptr},
             {"left_by", nullptr},
             {"by", by}};
  add_reason(rig, delta);
  return delta;
}

void add_rig_methods(rpc::Methods& methods, const Services& services) {
  const Services* const s = &services;
  methods.add({"rig.state",
               "the rig's own fact",
               {},
               {},
               {},
               "rig, run, latch (halt or estop), latched_by (with the reason, where one was "
               "given), left_by",
               rpc::Memory::over_restarts,
               rpc::Urgency::urgent},
              [s](const Call&) -> Outcome { return format_text(rig_json(*s->run_manager)); });
  add_stop(methods, "rig.halt",
           "stops motion where it is and latches the rig, each time that it is asked for; needs no "
           "lease and no role, on the local socket no session.open",
           [s](const Call& call) -> Outcome {
             s->run_manager->halt(runs::RigState::Stop::halt, by(call.caller),
                                  call.params.value("reason", ""));
             return latched(s->run_manager->rig_state().is_emergency());
           });
  add_stop(methods, "rig.estop",
           "as rig.halt, and only an engineer resets it. It is a stop by software: no rig has a "
           "power path that it could cut",
           [s](const Call& call) -> Outcome {
             s->run_manager->halt(runs::RigState::Stop::emergency, by(call.caller),
                                  call.params.value("reason", ""));
             return latched(true);
           });
  methods.add({"rig.reset",
               "somebody has looked at the rig: it may move again; after an emergency stop an "
               "engineer",
               Role::operator_,
               Effect::change,
               {{"reason", ParamType::text, true, "what was looked at"}},
               "latched"},
              [s](const Call& call) { return reset(*s, call); });
}

}  // namespace weft::daemon::api
