#include "daemon/hardware/rig/rig_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/base/file/read_file.hpp"
#include "drivers/api/config.hpp"
#include "protocols/base/json_text.hpp"
#include "recipes/engine/rig_limits.hpp"

namespace weft::daemon {
namespace {

using nlohmann::json;

/// Key of the limits and of a linear stage's configuration.
constexpr const char* acceleration_key = "acceleration_mm_s2";
constexpr const char* noise_key = "noise";  // of a tactile array's configuration

// Keys that this or another reader of the rig file understands: recipes::parse_rig_limits and
// sim::Rig read their own sections, drivers read `config`.
const std::vector<std::string> root_keys{"name",       "bench",   "devices", "limits",
                                         "probe",      "plate",   "control", "fabrics",
                                         "simulation", "plugins", "park",    "fixed"};
const std::vector<std::string> device_keys{"name", "role", "driver",   "config",  "link",
                                           "also", "http", "commands", "emulator"};

Status only_known_keys(const json& object, const std::vector<std::string>& known,
                       const std::string& where) {
  for (const auto& [key, value] : object.items()) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    const std::string meant = nearest_name(key, known);
    return fail({.where = where + "/" + key,
                 .what = "unknown key",
                 .hint = meant.empty() ? "" : "Did you mean " + meant + "?"});
  }
  return {};
}

Result<std::string> text_member(const json& object, const char* key, const std::string& where) {
  const auto found = object.find(key);
  if (found == object.end() || !found->is_string())
    return fail({.where = where + "/" + key,
                 .what = "missing or not a string",
                 .expected = "a string",
                 .got = found == object.end() ? "nothing" : std::string(found->type_name())});
  return found->get<std::string>();
}

Status read_more_links(const json& object, const std::string& where, DeviceEntry& device) {
  const json also = object.value("also", json::array());
  if (!also.is_array())
    return fail({.where = where + "/also",
                 .what = "not a list",
                 .expected = "links",
                 .got = also.type_name()});
  for (std::size_t i = 0; i < also.size(); ++i) {
    const auto link = parse_link(also[i].dump(), where + "/also/" + std::to_string(i));
    if (!link) return pass(link.error());
    device.also.push_back(*link);
  }
  for (const auto& [key, member] :
       {std::pair{"http", &device.http}, {"commands", &device.commands}}) {
    if (!object.contains(key)) continue;
    const auto port = parse_link(object[key].dump(), where + "/" + key);
    if (!port) return pass(port.error());
    *member = *port;
  }
  return {};
}

Result<DeviceEntry> device_entry(const json& object, const std::string& where) {
  if (!object.is_object())
    return fail({.where = where,
                 .what = "not a device",
                 .expected = "an object",
                 .got = object.type_name()});
  if (Status ok = only_known_keys(object, device_keys, where); !ok) return pass(ok.error());
  DeviceEntry device;
  for (auto [key, member] :
       {std::pair{"name", &device.name}, {"role", &device.role}, {"driver", &device.driver}}) {
    Result<std::string> value = text_member(object, key, where);
    if (!value) return pass(value.error());
    *member = *value;
  }
  if (!is_role(device.role))
    return fail({.where = where + "/role",
                 .what = "unknown role",
                 .expected = std::string(all_roles),
                 .got = device.role});
  device.config_json = object.value("config", json::object()).dump();
  Result<LinkSettings> link =
      parse_link(object.value("link", json::object()).dump(), where + "/link");
  if (!link) return pass(link.error());
  device.link = std::move(*link);
  if (Status more = read_more_links(object, where, device); !more) return pass(more.error());
  const json emulator = object.value("emulator", json::object());
  for (const auto& [key, member] :
       {std::pair{"model", &device.emulated_model}, {"stage", &device.emulated_stage}})
    if (emulator.is_object() && emulator.contains(key) && emulator[key].is_string())
      *member = emulator[key].get<std::string>();
  return device;
}

Result<BenchMode> bench_mode(const std::string& word) {
  if (word == "simulated") return BenchMode::simulated;
  if (word == "emulated") return BenchMode::emulated;
  if (word == "real") return BenchMode::real;
  return fail({.where = "/bench",
               .what = "unknown bench kind",
               .expected = "simulated, emulated or real",
               .got = word});
}

bool is_memory(const LinkSettings& link) {
  return std::holds_alternative<MemoryPort>(link);
}

// Pages are read over TCP on every bench with ports.
bool page_suits(const DeviceEntry& device, bool in_memory) {
  if (!device.http) return true;
  return in_memory ? is_memory(*device.http) : std::holds_alternative<TcpPort>(*device.http);
}

Status commands_suit(const DeviceEntry& device, BenchMode mode, const std::string& where) {
  if (!device.commands) return {};
  if (mode == BenchMode::emulated && std::holds_alternative<TcpPort>(*device.commands)) return {};
  return fail({.where = where + "/commands",
               .what = "command port not possible here",
               .expected = "tcp on an emulated bench"});
}

// A simulated bench has no ports; the others have only ports.
Status link_suits(const DeviceEntry& device, BenchMode mode, const std::string& where) {
  const bool in_memory = mode == BenchMode::simulated;
  if (is_memory(device.link) != in_memory)
    return fail({.where = where + "/link",
                 .what = "wrong kind of link for this bench",
                 .expected = in_memory ? "memory on a simulated bench"
                                       : "serial, tcp or udp on a real port",
                 .got = in_memory ? "a port" : "memory",
                 .hint = "See docs/reference/rig-keys.md"});
  if (!page_suits(device, in_memory))
    return fail({.where = where + "/http",
                 .what = "wrong kind of link for this bench",
                 .expected = in_memory ? "memory on a simulated bench" : "tcp on a real port"});
  if (Status s = commands_suit(device, mode, where); !s) return s;
  if (device.also.empty()) return {};
  if (mode != BenchMode::emulated || std::any_of(device.also.begin(), device.also.end(), is_memory))
    return fail({.where = where + "/also",
                 .what = "additional links not possible here",
                 .expected = "ports of an emulated bench"});
  return {};
}

Status links_suit(const RigFile& rig) {
  for (std::size_t i = 0; i < rig.devices.size(); ++i)
    if (Status s = link_suits(rig.devices[i], rig.mode, "/devices/" + std::to_string(i)); !s)
      return s;
  return {};
}

Result<Endpoint> read_console(const json& root) {
  const auto pointer = "/simulation/console"_json_pointer;
  json link = root.contains(pointer) ? root[pointer] : json();
  if (!link.is_object())
    return fail({.where = pointer.to_string(),
                 .what = "missing or not an object",
                 .expected = "host and port of the weft-rig console"});
  link["kind"] = "tcp";
  const Result<LinkSettings> console = parse_link(link.dump(), pointer.to_string());
  if (!console) return pass(console.error());
  return std::get<TcpPort>(*console).end;
}

Result<std::vector<std::filesystem::path>> plugin_folders(const json& root) {
  std::vector<std::filesystem::path> folders;
  const auto list = root.find("plugins");
  if (list == root.end()) return folders;
  const bool texts = list->is_array() && std::ranges::all_of(*list, [](const json& folder) {
                       return folder.is_string();
                     });
  if (!texts)
    return fail({.where = "/plugins",
                 .what = "not a list of folders",
                 .expected = "folders with drivers, relative to the rig file",
                 .got = list->dump()});
  for (const json& folder : *list) folders.emplace_back(folder.get<std::string>());
  return folders;
}

/// Errors in the limits are reported by recipes::parse_rig_limits.
void limit_acceleration(const json& root, std::vector<DeviceEntry>& devices) {
  constexpr double mm_per_m = 1e3;
  const json limits = root.value("limits", json::object());
  const bool in_mm = limits.is_object() && limits.contains(acceleration_key);
  const std::string key = in_mm ? acceleration_key : "acceleration_mps2";
  if (!limits.is_object() || !limits.contains(key) || !limits[key].is_number()) return;
  for (DeviceEntry& device : devices) {
    if (device.role != "x" && device.role != "y" && device.role != "z") continue;
    device.acceleration_mm_s2 = limits[key].get<double>() * (in_mm ? 1 : mm_per_m);
    device.acceleration_limit = "/limits/" + key;
  }
}

Status fill_roles(const json& root, RigFile& rig) {
  const Result<FixedAxes> fixed = read_fixed(root);
  if (!fixed) return pass(fixed.error());
  rig.fixed = *fixed;
  std::vector<std::string> roles;
  for (const DeviceEntry& device : rig.devices) roles.push_back(device.role);
  return roles_filled(roles, rig.fixed);
}

Result<RigFile> from_json(const json& root) {
  if (!root.is_object() || !root.contains("devices") || !root["devices"].is_array())
    return fail({.where = "/devices", .what = "not a rig file", .expected = "an array of devices"});
  if (Status ok = only_known_keys(root, root_keys, ""); !ok) return pass(ok.error());
  RigFile rig;
  Result<std::string> name = text_member(root, "name", "");
  if (!name) return pass(name.error());
  Result<std::string> bench = text_member(root, "bench", "");
  if (!bench) return pass(bench.error());
  const Result<BenchMode> mode = bench_mode(*bench);
  if (!mode) return pass(mode.error());
  rig.name = *name;
  rig.mode = *mode;
  rig.bench = *mode == BenchMode::real ? BenchKind::real : BenchKind::simulated;
  if (*mode == BenchMode::emulated) {
    Result<Endpoint> console = read_console(root);
    if (!console) return pass(console.error());
    rig.console = std::move(*console);
  }
  Result<std::vector<std::filesystem::path>> plugins = plugin_folders(root);
  if (!plugins) return pass(plugins.error());
  rig.plugins = std::move(*plugins);
  rig.drivers = std::make_shared<DriverCatalog>();
  if (root.contains("simulation")) {
    rig.plant_level = "auto";
    if (root["simulation"].contains("level")) {
      Result<std::string> level = text_member(root["simulation"], "level", "/simulation");
      if (!level) return pass(level.error());
      rig.plant_level = *level;
    }
  }
  for (std::size_t i = 0; i < root["devices"].size(); ++i) {
    Result<DeviceEntry> device = device_entry(root["devices"][i], "/devices/" + std::to_string(i));
    if (!device) return pass(device.error());
    if (rig.mode == BenchMode::real) {  // a real bench has no use for an emulator
      device->emulated_model.clear();
      device->emulated_stage.clear();
    }
    rig.devices.push_back(std::move(*device));
  }
  limit_acceleration(root, rig.devices);
  if (Status ok = fill_roles(root, rig); !ok) return pass(ok.error());
  for (DeviceEntry& device : rig.devices)
    device.noiseless = recipes::lacks_noise(root, device.role);
  if (Status ok = links_suit(rig); !ok) return pass(ok.error());
  return rig;
}

Result<RigFile> read_rig_file(const std::filesystem::path& path) {
  const auto text = read_text_file(path);
  if (!text) return pass(text.error());
  return parse_rig_file(*text);
}

}  // namespace

Result<RigFile> parse_rig_file(std::string_view text) {
  const Result<json> root = parse_json(text);
  if (!root) return pass(root.error());
  try {
    Result<RigFile> rig = from_json(*root);
    if (rig) rig->text = text;
    return rig;
  } catch (const json::exception& e) {
    return fail({.code = Errc::parse, .what = "not JSON", .got = e.what()});
  }
}

namespace {

/// Only a simulation may be without noise; its driver gets this as a setting.
Result<std::string> with_noise(const DeviceEntry& entry, json config) {
  if (entry.noiseless) {
    config[noise_key] = "none";
    return config.dump();
  }
  if (config.value(noise_key, json()) != "none") return entry.config_json;
  return fail({.code = Errc::invalid_argument,
               .where = std::string("/") + noise_key,
               .what = "value not allowed for a device with noise",
               .expected = "an emulator without noise, on a simulated or emulated bench",
               .got = "none",
               .hint = "Remove the key; it is set for a simulation without noise"});
}

/// A key may require another link of the device: its schema names the link as `x-link`.
Status has_needed_links(const DeviceEntry& entry, const json& config, const json& schema) {
  if (!config.is_object() || entry.http) return {};
  const json properties = schema.is_object() ? schema.value("properties", json()) : json();
  for (const auto& [key, value] : config.items())
    if (properties.contains(key) && properties[key].value("x-link", "") == "http" && value != "")
      return fail({.code = Errc::invalid_argument,
                   .where = "/" + key,
                   .what = "key needs the web pages of the box",
                   .expected = "an http link of the device",
                   .got = "none",
                   .hint = "Add \"http\" to the device, or remove " + key});
  return {};
}

}  // namespace

Result<std::string> driver_config(const DeviceEntry& entry, DriverCatalog& drivers) {
  constexpr double rounding = 1e-9;
  const Result<DriverSource> source = drivers.source(entry.driver);
  if (!source) return pass(source.error());
  const json schema = json::parse(source->config_schema_json, nullptr, false);
  json config = json::parse(entry.config_json, nullptr, false);
  if (Status linked = has_needed_links(entry, config, schema); !linked) return pass(linked.error());
  if (config.is_object() && schema.is_object() &&
      schema.contains("/properties/emulated_controller"_json_pointer)) {
    if (!entry.emulated_model.empty()) config["emulated_controller"] = entry.emulated_model;
    if (!entry.emulated_stage.empty()) config["emulated_stage"] = entry.emulated_stage;
  }
  if (config.is_object() && schema.is_object() && schema.contains("/properties/noise"_json_pointer))
    return with_noise(entry, std::move(config));
  if (entry.noiseless && config.is_object() && schema.is_object() &&
      schema.contains("/properties/stuck_after_s"_json_pointer)) {
    config["stuck_after_s"] = 0;  // equal readings are no fault without noise
    return config.dump();
  }
  if (!entry.acceleration_mm_s2 || !config.is_object() || !schema.is_object() ||
      !schema.contains("/properties/acceleration_mm_s2"_json_pointer))
    return config.is_object() ? config.dump() : entry.config_json;
  const double limit = *entry.acceleration_mm_s2;
  const json given = std::exchange(config[acceleration_key], limit);
  if (given.is_null()) return config.dump();
  if (!given.is_number() || std::abs(given.get<double>() - limit) <= rounding * limit) {
    config[acceleration_key] = given;
    return config.dump();
  }
  return fail({.code = Errc::invalid_argument,
               .where = std::string("/") + acceleration_key,
               .what = "acceleration differs from the limit of the rig",
               .expected = json(limit).dump() + " mm/s2, " + entry.acceleration_limit,
               .got = given.dump() + " mm/s2",
               .hint = "Remove the key to use the limit of the rig, or change that limit"});
}

Error in_rig_file(const DeviceEntry& entry, Error error) {
  const json config = json::parse(entry.config_json, nullptr, false);
  const bool sent = entry.acceleration_mm_s2 && !config.contains(acceleration_key);
  if (!sent || error.where != std::string("/") + acceleration_key) return error;
  error.where = entry.acceleration_limit;
  if (!error.where.ends_with(acceleration_key))
    error.hint = "Compare the limit in mm/s2, the unit of the stage driver";
  return error;
}

BenchKind load_bench_kind(const std::filesystem::path& rig) {
  const auto file = read_rig_file(rig);
  return file ? file->bench : BenchKind::unknown;
}

bool runs_in_real_time(const std::filesystem::path& rig) {
  const auto file = read_rig_file(rig);
  return !file || file->mode != BenchMode::simulated;
}

void use_plugins(RigFile& rig, const std::filesystem::path& rig_path, PluginSettings settings) {
  for (const std::filesystem::path& folder : rig.plugins)
    settings.folders.push_back(rig_path.parent_path() / folder);
  rig.drivers = std::make_shared<DriverCatalog>(std::move(settings));
}

}  // namespace weft::daemon
