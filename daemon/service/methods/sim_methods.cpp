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
  if (const auto run = services.run_manager->active())  // its times are others now
    services.run_manager->notify_changed(*run, by(call.caller));
  return format_text({{"pace", pace}});
}

/// What the emulator refuses, it refuses of the fault's own fields.
Error of_params(Error error) {
  if (error.where.starts_with('/') && error.where != "/rig") error.where = "/params" + error.where;
  return error;
}

/// The call without what is not the fault's.
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

json of_axes(const recipes::Joints& joints, bool linear, double per_unit) {
  json out = json::object();
  for (const recipes::Axis axis : recipes::all_axes)
    if (recipes::is_linear(axis) == linear) out[to_string(axis)] = joints[axis] * per_unit;
  return out;
}

json force_json(const LiveFrame& frame) {
  const WrenchSample& now = *frame.wrench;
  return {{"fx_n", now.force_n[0]},       {"fy_n", now.force_n[1]},     {"fz_n", now.force_n[2]},
          {"tx_nm", now.torque_nm[0]},    {"ty_nm", now.torque_nm[1]},  {"tz_nm", now.torque_nm[2]},
          {"fz_min_n", frame.least_fz_n}, {"fz_max_n", frame.most_fz_n}};
}

void publish(server::Hub& hub, const LiveFrame& frame, std::string_view run, std::int64_t t_us) {
  constexpr double mm_per_m = 1e3;
  constexpr double deg_per_rad = 57.29577951308232;
  const auto notify = [&](std::string_view topic, json delta) {
    delta["run"] = run;
    delta["by"] = "auto:run";
    delta["bench_s"] = frame.bench_s;
    hub.pass_on(topic, delta, t_us);
  };
  if (frame.wrench) notify("stream:force", force_json(frame));
  if (frame.joints)
    notify("stream:stages", {{"position_mm", of_axes(*frame.joints, true, mm_per_m)},
                             {"angle_deg", of_axes(*frame.joints, false, deg_per_rad)}});
  if (!frame.taxels.empty()) notify("stream:taxels", {{"counts", frame.taxels}});
}

}  // namespace

void publish_samples(server::Hub& hub, LiveFrameSampler& sampler, const runs::RunManager& manager,
                     std::int64_t t_us) {
  const bool wanted =
      hub.wanted("stream:force") || hub.wanted("stream:stages") || hub.wanted("stream:taxels");
  sampler.set_active(wanted);
  if (!wanted) return;
  const auto run = manager.active();
  const auto frame = sampler.take();
  if (run && frame) publish(hub, *frame, *run, t_us);
}

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
