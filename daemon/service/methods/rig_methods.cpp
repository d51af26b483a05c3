// Methods of the rig (description and state) and of its devices (role, link, driver options).

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/campaign/bench_check.hpp"
#include "daemon/service/methods/helpers.hpp"
#include "protocols/base/closest.hpp"
#include "recipes/schema/diagnostic.hpp"

namespace weft::daemon::api {
namespace {

using runs::RunState;

/// State of a rig that a run controls.
std::string_view fact_of(RunState state) {
  const bool is_waiting = state == RunState::held || state == RunState::awaiting_operator;
  return is_waiting ? "holding" : "moving";
}

/// One word for the rig: the latch has precedence, then motion, then the fact.
std::string_view format_rig(const runs::RigState& rig, bool is_moved_by_hand) {
  if (rig.is_latched()) return "latched";
  return is_moved_by_hand ? "moving" : to_string(rig.facts().fact);
}

/// The fact, and the reasons why the rig may not move.
void add_facts(const runs::RigFacts& facts, json& out) {
  out["fact"] = to_string(facts.fact);
  if (facts.latch) {
    out["latch"] = facts.latch->is_emergency ? "estop" : "halt";
    out["latched_by"] = facts.latch->why;
  }
  if (!facts.left_by.empty()) {
    out["left_by"] = facts.left_by;
    out["acknowledged"] = facts.acknowledged;
  }
  if (facts.lock_out)
    out["locked"] = {{"by", facts.lock_out->user},
                     {"reason", facts.lock_out->reason},
                     {"since_us", facts.lock_out->since_us}};
}

}  // namespace

json rig_json(const runs::RunManager& manager) {
  const runs::RigState& rig = manager.rig_state();
  const auto run = manager.active();
  const auto maintenance = manager.status().maintenance;
  json out{{"rig", format_rig(rig, maintenance.has_value())}};
  if (run && !rig.is_latched()) out["rig"] = fact_of(manager.get(*run)->machine.state);
  if (run) out["run"] = *run;
  if (maintenance) out["maintenance"] = *maintenance;
  add_facts(rig.facts(), out);
  return out;
}

namespace {

json point_of(const recipes::Vec2& point) {
  return {{"x_m", point.x_m}, {"y_m", point.y_m}};
}

/// Key "y_m": travel [min, max] of a movable axis, or position of a fixed axis [m, rad].
json axes_of(const recipes::Geometry& geometry, bool fixed) {
  json out = json::object();
  for (const recipes::Axis axis : recipes::all_axes) {
    if (geometry.is_fixed(axis) != fixed) continue;
    const recipes::Range& range = geometry.travel[recipes::index(axis)];
    const std::string unit = recipes::is_linear(axis) ? "_m" : "_rad";
    out[std::string(to_string(axis)) + unit] = fixed ? json(range.min) : json{range.min, range.max};
  }
  return out;
}

/// Null if the rig file does not give the taxels' layout.
json shape_of(const recipes::TaxelArray& array) {
  if (array.places_m.size() == array.taxels) {
    json places = json::array();
    for (const recipes::Vec2& at : array.places_m) places.push_back(point_of(at));
    return {{"places", std::move(places)}};
  }
  if (array.rows * array.cols != array.taxels) return nullptr;
  return {{"rows", array.rows}, {"columns", array.cols}};
}

json shape_of(const recipes::RigLimits& rig) {
  if (rig.taxel_arrays.empty()) return nullptr;
  if (rig.taxel_arrays.size() == 1) return shape_of(rig.taxel_arrays.front());
  json arrays = json::array();
  for (const recipes::TaxelArray& array : rig.taxel_arrays)
    arrays.push_back(
        {{"device", array.device}, {"taxels", array.taxels}, {"shape", shape_of(array)}});
  return {{"arrays", std::move(arrays)}};
}

/// Largest span of all taxel arrays [counts]; null if the rig file gives none.
json span_of(const recipes::RigLimits& rig) {
  std::uint16_t most = 0;
  for (const recipes::TaxelArray& array : rig.taxel_arrays)
    most = std::max(most, array.span_counts);
  return most > 0 ? json(most) : json();
}

Outcome describe_rig(const Services& services, const Call&) {
  const auto opened = open_rig(services.rig, {});
  if (!opened) return refused(opened.error());
  const recipes::RigLimits& rig = opened->limits;
  return format_text({{"rig", services.rig_name},
                      {"bench", rig.bench},
                      {"simulated", rig.bench != "real"},
                      {"wrench", rig.has_wrench},
                      {"force_cap_n", rig.has_wrench ? json(rig.force_cap_n) : json()},
                      {"torque_cap_nm", rig.has_wrench ? json(rig.torque_cap_nm) : json()},
                      {"travel", axes_of(rig.geometry, false)},
                      {"fixed", axes_of(rig.geometry, true)},
                      {"plate",
                       {{"origin", point_of(rig.geometry.origin_m)},
                        {"size", point_of(rig.geometry.plate_size_m)},
                        {"surface_z_m", rig.geometry.surface_z_m}}},
                      {"footprint", point_of(rig.footprint_m)},
                      {"clearance_m", rig.clearance_m},
                      {"taxels", rig.taxels},
                      {"taxel_shape", shape_of(rig)},
                      {"taxel_span_counts", span_of(rig)},
                      {"fabrics", rig.fabrics}});
}

/// Null if a plugin returned invalid JSON.
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
          .what = "unknown device",
          .got = recipes::clipped(name),
          .hint = did_you_mean(name, known, "List the devices with device.list")};
}

/// Loads the driver's plugin, if it is one, so it must not run on the server's thread.
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
      {{"reason", ParamType::text, false, "reason, shown to the person who resets the rig"}},
      "latched, latch, warnings (errors of the request, which was executed nevertheless; only "
      "if there are any)",
      [kind](const Services& services, const Call& call) { return stop(services, call, kind); });
  spec.memory = rpc::Memory::while_running;
  spec.urgency = rpc::Urgency::stop;
}

/// Resetting an e-stop requires a role that may change the rig; an operator may not.
Outcome reset(const Services& services, const Call& call) {
  if (auto free = require_free_lease(services, call.caller); !free)
    return tl::unexpected(free.error());
  if (services.run_manager->rig_state().is_emergency() && call.caller.role < Role::engineer)
    return refused(rpc::code::access + 3, "access.role",
                   {.code = Errc::wrong_state,
                    .where = "rig.reset",
                    .what = "role not permitted to reset an e-stop",
                    .expected = std::string(access::to_string(Role::engineer)),
                    .got = std::string(access::to_string(call.caller.role)),
                    .hint = "Ask an engineer to inspect and reset the rig"});
  if (auto open = require_unlocked(services); !open) return tl::unexpected(open.error());
  const std::string reason = call.params.at("reason").get<std::string>();
  if (const Status ok = services.run_manager->reset(reason, by(call.caller)); !ok)
    return refused(ok.error());
  json out = rig_json(*services.run_manager);
  out["latched"] = false;
  return format_text(out);
}

Outcome lock(const Services& services, const Call& call) {
  const runs::LockOut lock{call.caller.user, call.params.at("reason").get<std::string>(),
                           services.utc_us()};
  if (lock.reason.size() < 3)
    return refused(
        bad_param("reason", "reason missing or too short", "at least 3 characters", lock.reason));
  const auto& held = services.run_manager->rig_state().facts().lock_out;
  if (held && held->user != lock.user) return tl::unexpected(require_unlocked(services).error());
  if (const Status ok = services.run_manager->lock_out(lock, by(call.caller)); !ok)
    return refused(ok.error());
  return format_text(rig_json(*services.run_manager));
}

Outcome unlock(const Services& services, const Call& call) {
  const runs::UnlockRequest wanted{call.caller.user, call.caller.role >= Role::engineer,
                                   call.params.value("reason", "")};
  const auto& held = services.run_manager->rig_state().facts().lock_out;
  if (held && held->user != wanted.user && !wanted.is_allowed_for_others)
    return tl::unexpected(require_unlocked(services).error());
  if (const Status ok = services.run_manager->unlock(wanted, by(call.caller)); !ok)
    return refused(ok.error());
  return format_text(rig_json(*services.run_manager));
}

void maintain(const Services& services, const Call& call, const Responder& respond,
              const recipes::MaintenanceOrder& order) {
  if (auto held = holds_lease(services, call); !held) return respond(tl::unexpected(held.error()));
  if (auto open = require_unlocked(services); !open) return respond(tl::unexpected(open.error()));
  services.run_manager->maintain(order, by(call.caller),
                                 [respond, order](const Result<MaintenanceSummary>& summary) {
                                   if (!summary) return respond(refused(summary.error()));
                                   respond(format_text(runs::maintenance_json(order, *summary)));
                                 });
}

void jog(const Services& services, const Call& call, const Responder& respond) {
  const std::string name = call.params.at("axis").get<std::string>();
  const auto axis = std::ranges::find(recipes::all_axes, name,
                                      [](recipes::Axis each) { return to_string(each); });
  if (axis == recipes::all_axes.end())
    return respond(refused(bad_param("axis", "unknown axis", "x, y, z, rx or ry", name)));
  maintain(services, call, respond,
           {recipes::MaintenanceKind::jog, *axis, call.params.at("distance").get<double>()});
}

constexpr std::string_view maintenance_result =
    "order, from, to (positions by axis), relative (z was not homed: it rose from its present "
    "position), outcome, rig (safe: the probe is at the clear height; holding; unknown), error";

void add_maintenance(MethodGroup& group) {
  group.change("rig.retract",
               "lift the probe to the clear height, outside a run and without homing; answers when "
               "the motion has ended. If z is not homed, it rises by at most the clearance",
               Role::operator_, {rig_lease_param}, maintenance_result,
               [](const Services& services, const Call& call, const Responder& respond) {
                 maintain(services, call, respond, {recipes::MaintenanceKind::retract});
               });
  group.change("rig.park",
               "lift the probe, then move x, y, rx and ry to the rig file's park position, outside "
               "a run; every stage must be homed; answers when the motion has ended",
               Role::operator_, {rig_lease_param}, maintenance_result,
               [](const Services& services, const Call& call, const Responder& respond) {
                 maintain(services, call, respond, {recipes::MaintenanceKind::park});
               });
  group.change("rig.jog",
               "move one axis by at most 5 mm or 1 degree, at a tenth of its speed, outside a run; "
               "every motion except z up stops when the force changes by 1 N; answers when the "
               "motion has ended",
               Role::operator_,
               {rig_lease_param,
                {"axis", ParamType::text, true, "axis (x, y, z, rx, ry)"},
                {"distance", ParamType::number, true,
                 "distance [m], for rx and ry [rad]; positive z is down"}},
               maintenance_result, jog);
}

}  // namespace

json rig_delta(const runs::RunManager& manager, std::string_view by) {
  const runs::RigState& rig = manager.rig_state();
  const auto maintenance = manager.status().maintenance;
  json delta{{"rig", format_rig(rig, maintenance.has_value())},
             {"maintenance", maintenance ? json(*maintenance) : json()},
             {"latch", nullptr},
             {"latched_by", nullptr},
             {"left_by", nullptr},
             {"acknowledged", nullptr},
             {"locked", nullptr},
             {"by", by}};
  add_facts(rig.facts(), delta);
  return delta;
}

void add_rig_methods(rpc::Methods& methods, const Services& services) {
  MethodGroup group(methods, services);
  group
      .read("rig.state",
            "get the state of the rig: motion, how the last run left it, latch and lock-out", {},
            "rig (moving, holding, safe, unknown or latched), run, maintenance (motion outside a "
            "run: retract, park or jog), fact (safe, holding or unknown: how the newest run left "
            "it), left_by, acknowledged (a person has reset it since), latch (halt or estop), "
            "latched_by (with the reason), locked: by, reason, since_us",
            [](const Services& s, const Call&) { return format_text(rig_json(*s.run_manager)); })
      .urgency = rpc::Urgency::urgent;
  add_stop(
      group, "rig.halt",
      "stop all motion in place and latch the rig; repeated calls do so again. Needs no lease and "
      "no role, and on the local socket no session.open",
      runs::RigState::Stop::halt);
  add_stop(group, "rig.estop",
           "stop as rig.halt does; only an engineer can reset it. This is a stop by software: it "
           "cuts no power",
           runs::RigState::Stop::emergency);
  group.change(
      "rig.reset",
      "clear the latch after inspecting the rig; an e-stop needs an engineer. Nothing moves, the "
      "fact does not change, and a queue with runs is paused",
      Role::operator_,
      {{"reason", ParamType::text, true, "result of the inspection, at least 3 characters"}},
      "latched, and as rig.state", reset);
  group.change(
      "rig.lock",
      "lock the rig out in your name: until rig.unlock nothing moves, also after a restart",
      Role::operator_, {{"reason", ParamType::text, true, "reason, shown to other users"}},
      "as rig.state", lock);
  group.change(
      "rig.unlock", "remove your lock-out, or as an engineer that of another user with a reason",
      Role::operator_,
      {{"reason", ParamType::text, false, "reason; needed for the lock-out of another user"}},
      "as rig.state", unlock);
  add_maintenance(group);
  group.read(
      "rig.describe", "describe the rig and its limits, from its rig file", {},
      "rig, bench (simulated, emulated, real), simulated, wrench (false: no force sensor, and "
      "the caps are null), force_cap_n, torque_cap_nm, travel by axis, fixed (positions of axes "
      "without a stage), plate: origin, size, surface_z_m; footprint of the probe, "
      "clearance_m, taxels, taxel_shape (rows and columns, or places; null: not stated; several "
      "arrays: each with device, taxels and shape), taxel_span_counts (full colour range of a "
      "taxel map; null: not stated), fabrics",
      describe_rig);
  group.read("device.list", "list the devices of the rig file", {},
             "rig, bench, devices: device, role, driver, link", list_devices);
  group.read("device.describe",
             "describe a device: its driver, its configuration and the schema of that",
             {{"device", ParamType::text, true, "name of the device, \"stage.z\""}},
             "device, role, driver, link, summary, bench, plugin (its file, or null), config, "
             "config_schema: JSON Schema, draft 2020-12, with x-unit, and x-safety for values that "
             "protect people or equipment",
             describe_device);
}

}  // namespace weft::daemon::api
