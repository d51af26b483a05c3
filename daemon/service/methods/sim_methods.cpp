#include <nlohmann/json.hpp>

#include "daemon/campaign/bench_check.hpp"
#include "daemon/service/methods/helpers.hpp"

namespace weft::daemon::api {
namespace {

Outcome set_pace(const Services& services, const Call& call) {
  if (auto free = require_free_lease(services, call.caller); !free)
    return tl::unexpected(free.error());
  const double pace = call.params.at("pace").get<double>();
  if (!is_pace(pace))
    return refused({.code = Errc::range,
                    .where = "/params/pace",
                    .what = "pace out of range",
                    .expected = "0, or 1 to 1 000 000",
                    .got = call.params.at("pace").dump(),
                    .hint = "Use 0 to run the bench as fast as possible"});
  const auto rig = open_rig(services.rig, {});
  if (!rig) return refused(rig.error());
  if (rig->file.mode != BenchMode::simulated)
    return refused({.code = Errc::wrong_state,
                    .where = services.rig.string(),
                    .what = "rig runs in real time; its pace is fixed",
                    .expected = "a simulated bench"});
  services.pace->store(pace, std::memory_order_relaxed);
  if (const auto run = services.run_manager->active())  // its remaining time has changed
    services.run_manager->notify_changed(*run, by(call.caller));
  return format_text({{"pace", pace}});
}

/// The emulator's errors point into the fault object; makes them point into /params.
Error of_params(Error error) {
  if (error.where.starts_with('/') && error.where != "/rig") error.where = "/params" + error.where;
  return error;
}

/// The call's parameters without those that are not part of the fault.
json read_fault(const Call& call) {
  json out = call.params;
  out.erase("idem");
  return out;
}

void inject_fault(const Services& services, const Call& call, bool ends, const Responder& respond) {
  if (auto free = require_free_lease(services, call.caller); !free)
    return respond(tl::unexpected(free.error()));
  json fault = read_fault(call);
  if (ends && !fault.contains("fault")) fault["fault"] = "";
  const auto run = services.run_manager->active();
  services.run_manager->inject_fault({fault.dump(), ends, by(call.caller), {}},
                                     [respond, run, fault](const Status& done) {
                                       if (!done) return respond(refused(of_params(done.error())));
                                       json reply = fault;
                                       reply["run"] = run ? json(*run) : json();
                                       respond(format_text(reply));
                                     });
}

}  // namespace

void add_sim_methods(rpc::Methods& methods, const Services& services) {
  MethodGroup group(methods, services);
  group.change(
      "sim.clock",
      "set the simulation speed, for the active and later runs; the daemon starts with --pace",
      Role::operator_,
      {{"pace", ParamType::number, true,
        "bench seconds per wall second, 1 to 1000000; 0: as fast as possible"}},
      "pace", set_pace);
  constexpr rpc::ParamSpec device_param{"device", ParamType::text, true,
                                        "name of the device, see device.list"};
  group.change(
      "sim.inject",
      "inject a fault into a device of the active run, on a simulated or emulated bench, once its "
      "devices are armed; kinds: docs/reference/faults.md",
      Role::engineer,
      {device_param,
       {"fault", ParamType::text, true, "kind of the fault, \"drop\""},
       {"start_s", ParamType::number, false, "delay in bench time [s] (default: 0)"},
       {"duration_s", ParamType::number, false, "duration [s] (default: unlimited)"},
       {"probability", ParamType::number, false,
        "probability for each message or reading, 0 to 1 (default: 1)"},
       {"amount", ParamType::number, false, "size of the fault, in the unit of its kind"},
       {"towards", ParamType::text, false,
        "direction of a link fault (default: host; host, device)"}},
      "the fault, run", [](const Services& s, const Call& call, const Responder& respond) {
        inject_fault(s, call, false, respond);
      });
  group.change(
      "sim.clear", "end the injected faults of a device, including those of the rig file",
      Role::engineer,
      {device_param, {"fault", ParamType::text, false, "kind of the fault (default: all)"}},
      "device, fault, run", [](const Services& s, const Call& call, const Responder& respond) {
        inject_fault(s, call, true, respond);
      });
}

}  // namespace weft::daemon::api
