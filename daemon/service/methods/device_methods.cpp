// The rig's devices: what each is for, how it is reached, and what its driver may be told.

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/campaign/bench_check.hpp"
#include "daemon/service/methods/helpers.hpp"
#include "recipes/schema/diagnostic.hpp"

namespace weft::daemon::api {
namespace {

using nlohmann::json;
using rpc::Call;
using rpc::Outcome;
using rpc::ParamType;

/// null where a plugin says what is no JSON.
json stored(const std::string& text) {
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

Outcome listed(const Services& services) {
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
  const std::string_view meant = recipes::closest(name, known);
  return {.code = Errc::not_found,
          .where = "/params/device",
          .what = "the rig has no such device",
          .got = recipes::clipped(name),
          .hint = meant.empty() ? "See device.list" : "Did you mean " + std::string(meant) + "?"};
}

/// Loads the driver's plugin, where it is one: for another thread than the server's.
Outcome described(const std::filesystem::path& file, const std::string& name) {
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
  out["config"] = stored(found->config_json);
  out["config_schema"] = stored(driver->config_schema_json);
  return format_text(out);
}

}  // namespace

void add_device_methods(rpc::Methods& methods, const Services& services) {
  const Services* const s = &services;
  methods.add({"device.list",
               "the rig's devices, as its file has them",
               {},
               {},
               {},
               "rig, bench, devices: device, role, driver, link"},
              [s](const Call&) { return listed(*s); });
  methods.add({"device.describe",
               "what a device's driver may be told, and what the rig file tells it",
               {},
               {},
               {{"device", ParamType::text, true, "its name, \"stage.z\""}},
               "device, role, driver, link, summary, bench, plugin (its file, or null), config, "
               "config_schema: JSON Schema, draft 2020-12, with x-unit, and x-safety where a value "
               "guards somebody or something"},
              rpc::Handler([s](const Call& call, const rpc::Responder& respond) {
                answer_in_background(
                    s->background, respond,
                    [rig = s->rig, name = call.params.at("device").get<std::string>()] {
                      return described(rig, name);
                    });
              }));
}

}  // namespace weft::daemon::api
