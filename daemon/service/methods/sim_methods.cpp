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
                    .what = "no such pace",
                    .expected = "0, or 1 to 1 000 000",
                    .got = call.params.at("pace").dump(),
                    .hint = "0 lets the bench go as fast as it can"});
  const auto rig = open_rig(services.rig, {});
  if (!rig) return refused(rig.error());
  if (rig->file.mode != BenchMode::simulated)
    return refused({.code = Errc::wrong_state,
                    .where = services.rig.string(),
                    .what = "the time of this rig is the world's",
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
  group.change("sim.clock",
               "how fast the time of a simulated bench passes, now and in later runs; the daemon "
               "begins with --pace",
               Role::operator_,
               {{"pace", ParamType::number, true,
                 "bench seconds per second, 1 to 1000000; 0: as fast as it can"}},
               "pace", set_pace);
  constexpr rpc::ParamSpec device_param{"device", ParamType::text, true,
                                        "its name, see device.list"};
  group.change(
      "sim.inject",
      "lets a fault befall a device of the simulated or emulated bench of the run under way, once "
      "its devices are up; kinds: sim/devices/README.md",
      Role::engineer,
      {device_param,
       {"fault", ParamType::text, true, "its kind, \"drop\""},
       {"start_s", ParamType::number, false, "from now, on the bench's clock [s], 0"},
       {"duration_s", ParamType::number, false, "[s]; for ever where it is left out"},
       {"probability", ParamType::number, false, "0 to 1 of each message or reading, 1"},
       {"amount", ParamType::number, false, "how much, in the unit of the kind"},
       {"towards", ParamType::text, false, "host (default) or device, of faults of the wire"}},
      "the fault, run", [](const Services& s, const Call& call, const Responder& respond) {
        inject_fault(s, call, false, respond);
      });
  group.change(
      "sim.clear", "ends such faults of a device, also those of its rig file", Role::engineer,
      {device_param, {"fault", ParamType::text, false, "its kind; all where it is left out"}},
      "device, fault, run", [](const Services& s, const Call& call, const Responder& respond) {
        inject_fault(s, call, true, respond);
      });
}

}  // namespace weft::daemon::api
