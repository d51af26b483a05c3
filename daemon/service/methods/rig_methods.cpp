// The rig: what it is and how it stands; its devices: what each is for, how it is reached, and what
// its driver may be told.

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/campaign/bench_check.hpp"
#include "daemon/service/methods/helpers.hpp"
#include "recipes/schema/diagnostic.hpp"

namespace weft::daemon::api {
namespace {

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

}  // namespace

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

namespace {

json point_of(const recipes::Vec2& point) {
  return {{"x_m", point.x_m}, {"y_m", point.y_m}};
}

json travel_of(const recipes::Geometry& geometry) {
  json out = json::object();
  for (const recipes::Axis axis : recipes::all_axes) {
    const recipes::Range& range = geometry.travel[recipes::index(axis)];
    const std::string unit = recipes::is_linear(axis) ? "_m" : "_rad";
    out[std::string(to_string(axis)) + unit] = {range.min, range.max};
  }
  return out;
}

Outcome describe_rig(const Services& services, const Call&) {
  const auto opened = open_rig(services.rig, {});
  if (!opened) return refused(opened.error());
  const recipes::RigLimits& rig = opened->limits;
  return format_text({{"rig", services.rig_name},
                      {"bench", rig.bench},
                      {"simulated", rig.bench != "real"},
                      {"force_cap_n", rig.force_cap_n},
                      {"torque_cap_nm", rig.torque_cap_nm},
                      {"travel", travel_of(rig.geometry)},
                      {"plate",
                       {{"origin", point_of(rig.geometry.origin_m)},
                        {"size", point_of(rig.geometry.plate_size_m)},
                        {"surface_z_m", rig.geometry.surface_z_m}}},
                      {"footprint", point_of(rig.footprint_m)},
                      {"clearance_m", rig.clearance_m},
                      {"taxels", rig.taxels},
                      {"fabrics", rig.fabrics}});
}

/// null where a plugin says what is no JSON.
json json_or_null(const std::string& text) {
  json out = json::parse(text, nullptr, false);
  return out.is_discarded() ? json() : out;
}

json endpoint_json(const char* kind, const Endpoint& end) {
  return {{"kind", kind}, {"host", end.host}, {"port", end.port}};
}

json link_json(const LinkSettings& link) {
  if (const auto* serial = std::get_if<SerialSettings>(&link))
    return {{"kind", "serial"}, {"path", serial->path}, {"baud", serial->baud}};
  if (const auto* tcp = std::get_if<TcpPort>(&link)) return endpoint_json("tcp", tcp->end);
  if (const auto* udp = std::get_if<UdpPort>(&link)) {
    json out = endpoint_json("udp", udp->end);
    if (udp->local_port != 0) out["local_port"] = udp->local_port;
    return out;
  }
  return {{"kind", "memory"}};
}

json device_json(const DeviceEntry& device) {
  return {{"device", device.name},
          {"role", device.role},
          {"driver", device.driver},
          {"link", link_json(device.link)}};
}

Outcome list_devices(const Services& services, const Call&) {
  const auto opened = open_rig(services.rig, {});
  if (!opened) return refused(opened.error());
  const RigFile& rig = opened->file;
  json out = json::array();
  for (const DeviceEntry& device : rig.devices) out.push_back(device_json(device));
  return format_text(
      {{"rig", services.rig_name}, {"bench", to_string(rig.bench)}, {"devices", std::move(out)}});
}

Error no_such_device(const RigFile& rig, const std::string& name) {
  std::vector<std::string_view> known;
  for (const DeviceEntry& device : rig.devices) known.push_back(device.name);
  return {.code = Errc::not_found,
          .where = "/params/device",
          .what = "the rig has no such device",
          .got = recipes::clipped(name),
          .hint = rpc::did_you_mean(name, known, "See device.list")};
}

/// Loads the driver's plugin, where it is one: for another thread than the server's.
Outcome described_device(const std::filesystem::path& file, const std::string& name) {
  const auto opened = open_rig(file, {});
  if (!opened) return refused(opened.error());
  const RigFile& rig = opened->file;
  const auto found = std::ranges::find(rig.devices, name, &DeviceEntry::name);
  if (found == rig.devices.end()) return refused(no_such_device(rig, name));
  const auto driver = rig.drivers->source(found->driver);
  if (!driver) return refused(driver.error());
  json out = device_json(*found);
  out["summary"] = driver->summary;
  out["bench"] = to_string(rig.bench);
  out["plugin"] = driver->file.empty() ? json() : json(driver->file);
  out["config"] = json_or_null(found->config_json);
  out["config_schema"] = json_or_null(driver->config_schema_json);
  return format_text(out);
}

void describe_device(const Services& services, const Call& call, const Responder& respond) {
  answer_in_background(services.background, respond,
                       [rig = services.rig, name = call.params.at("device").get<std::string>()] {
                         return described_device(rig, name);
                       });
}

Outcome stop(const Services& services, const Call& call, runs::RigState::Stop kind) {
  services.run_manager->halt(kind, by(call.caller), call.params.value("reason", ""));
  const bool emergency =
      kind == runs::RigState::Stop::emergency || services.run_manager->rig_state().is_emergency();
  return format_text({{"latched", true}, {"latch", emergency ? "estop" : "halt"}});
}

void add_stop(MethodGroup& group, std::string_view name, std::string_view summary,
              runs::RigState::Stop kind) {
  rpc::MethodSpec& spec = group.change(
      name, summary, Role::observer,
      {{"reason", ParamType::text, false, "a few words, for whoever resets it"}},
      "latched, latch, warnings (what was wrong with the request, which was heeded all "
      "the same; only where there is some)",
      [kind](const Services& services, const Call& call) { return stop(services, call, kind); });
  spec.memory = rpc::Memory::while_running;
  spec.urgency = rpc::Urgency::stop;
}

/// An emergency stop is released by who may change the rig, not by who runs recipes on it.
Outcome reset(const Services& services, const Call& call) {
  if (auto free = require_free_lease(services, call.caller); !free)
    return tl::unexpected(free.error());
  if (services.run_manager->rig_state().is_emergency() && call.caller.role < Role::engineer)
    return refused(rpc::code::access + 3, "access.role",
                   {.code = Errc::wrong_state,
                    .where = "rig.reset",
                    .what = "an emergency stop is not released by an operator",
                    .expected = std::string(access::to_string(Role::engineer)),
                    .got = std::string(access::to_string(call.caller.role)),
                    .hint = "An engineer looks at the rig, then resets it"});
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
  MethodGroup group(methods, services);
  group
      .read("rig.state", "the rig's own fact", {},
            "rig, run, latch (halt or estop), latched_by (with the reason, where one was "
            "given), left_by",
            [](const Services& s, const Call&) { return format_text(rig_json(*s.run_manager)); })
      .urgency = rpc::Urgency::urgent;
  add_stop(group, "rig.halt",
           "stops motion where it is and latches the rig, each time that it is asked for; needs no "
           "lease and no role, on the local socket no session.open",
           runs::RigState::Stop::halt);
  add_stop(group, "rig.estop",
           "as rig.halt, and only an engineer resets it. It is a stop by software: no rig has a "
           "power path that it could cut",
           runs::RigState::Stop::emergency);
  group.change("rig.reset",
               "somebody has looked at the rig: it may move again; after an emergency stop an "
               "engineer",
               Role::operator_, {{"reason", ParamType::text, true, "what was looked at"}},
               "latched", reset);
  group.read("rig.describe", "what the rig is and can do, as its file says", {},
             "rig, bench (simulated, emulated, real), simulated, force_cap_n, torque_cap_nm, "
             "travel by axis, plate: origin, size, surface_z_m; footprint of the probe, "
             "clearance_m, taxels, fabrics",
             describe_rig);
  group.read("device.list", "the rig's devices, as its file has them", {},
             "rig, bench, devices: device, role, driver, link", list_devices);
  group.read("device.describe",
             "what a device's driver may be told, and what the rig file tells it",
             {{"device", ParamType::text, true, "its name, \"stage.z\""}},
             "device, role, driver, link, summary, bench, plugin (its file, or null), config, "
             "config_schema: JSON Schema, draft 2020-12, with x-unit, and x-safety where a value "
             "guards somebody or something",
             describe_device);
}

}  // namespace weft::daemon::api
