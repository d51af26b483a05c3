#include "recipes/engine/rig_sensors.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "recipes/schema/object_reader.hpp"
#include "recipes/schema/quantities.hpp"

namespace weft::recipes {
namespace {

using nlohmann::json;

/// Below this the force loop oscillates about the set point, and a bias of 50 readings takes long.
constexpr double least_wrench_rate_hz = 20;

const json& devices_of(const json& rig) {
  static const json none = json::array();
  const auto found = rig.is_object() ? rig.find("devices") : rig.end();
  return found != rig.end() && found->is_array() ? *found : none;
}

std::string name_of(const json& device) {
  const auto found = device.find("name");
  return found != device.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// A number of taxels, or rows and columns of an imprint array.
void read_array(const json& device, ObjectReader& config, TaxelArray& array, RigLimits& limits) {
  config.set(array.rate_hz, {"rate_hz", {{"rate_hz", 1}}}, {0.1, 1e4, {}});
  const auto taxels = config.integer("taxels", 1, 64, Need::optional);
  if (taxels) array.taxels = static_cast<std::size_t>(*taxels);
  const auto rows = config.integer("rows", 1, 128, Need::optional);
  const auto cols = config.integer("cols", 1, 128, Need::optional);
  if (rows && cols) {
    limits.imprint_array |= device.value("driver", json()) != "taxel_array";
    array.rows = static_cast<std::size_t>(*rows);
    array.cols = static_cast<std::size_t>(*cols);
    array.taxels = array.rows * array.cols;
  }
  if (const auto span = config.integer("span_counts", 1, 65535, Need::optional))
    array.span_counts = static_cast<std::uint16_t>(*span);
  const json* places = config.array("positions_mm", Need::optional);
  for (std::size_t i = 0; places != nullptr && i + 1 < places->size(); i += 2)
    if ((*places)[i].is_number() && (*places)[i + 1].is_number())
      array.places_m.push_back({(*places)[i].get<double>() / quantities::mm_per_m,
                                (*places)[i + 1].get<double>() / quantities::mm_per_m});
}

void read_vibration(ObjectReader& config, RigLimits& limits) {
  limits.acceleration_rate_hz = 200;
  limits.sound_rate_hz = 8000;
  config.set(limits.acceleration_rate_hz, {"acceleration_rate", {{"acceleration_rate_hz", 1}}},
             {0, 1e5, {}});
  config.set(limits.sound_rate_hz, {"sound_rate", {{"sound_rate_hz", 1}}}, {0, 4e5, {}});
}

void read_sensor(const json& device, ObjectReader& config, RigLimits& limits) {
  const json role = device.value("role", json());
  if (role == "vibro") return read_vibration(config, limits);
  if (role == "taxels") return read_array(device, config, limits.taxel_arrays.back(), limits);
  config.set(limits.wrench_rate_hz, {"rate_hz", {{"rate_hz", 1}}},
             {least_wrench_rate_hz, 7000, "as required by the force control"});
}

void join_arrays(RigLimits& limits, Problems& problems) {
  const std::vector<TaxelArray>& arrays = limits.taxel_arrays;
  if (arrays.empty()) return;
  limits.taxel_rate_hz = arrays.front().rate_hz;
  limits.taxels = 0;
  for (const TaxelArray& array : arrays) limits.taxels += array.taxels;
  if (limits.imprint_array && arrays.size() > 1)
    problems.add({"/devices", "imprint array not alone", "one array",
                  std::to_string(arrays.size()) + " devices with role taxels",
                  "Remove the other arrays"});
}

/// A scene without taxels: the readings of the wrench carry the phases.
void forgo(const json& rig, RigLimits& limits, Problems& problems) {
  if (!limits.has_wrench) limits.wrench_rate_hz = 0;
  if (has_role(rig, "taxels")) return;
  limits.taxels = 0;
  limits.taxel_rate_hz = limits.wrench_rate_hz;
  if (!limits.has_wrench)
    problems.add({"/devices", "rig without a sensor for contact",
                  "a device with role wrench or taxels", "", ""});
}

void read_noise(const json& rig, RigLimits& limits) {
  limits.wrench_noise = !lacks_noise(rig, "wrench");
  limits.taxel_noise = !lacks_noise(rig, "taxels");
  if (!limits.wrench_noise) limits.frozen_wrench_s = 0;
  if (!limits.taxel_noise) limits.frozen_taxels_s = 0;
}

}  // namespace

bool has_role(const json& rig, const char* role) {
  const json& devices = devices_of(rig);
  return devices.empty() || std::ranges::any_of(devices, [&](const json& device) {
           return device.is_object() && device.value("role", json()) == role;
         });
}

void read_sensors(const json& rig, RigLimits& limits, Problems& problems) {
  const json& devices = devices_of(rig);
  for (std::size_t i = 0; i < devices.size(); ++i) {
    const json& device = devices[i];
    if (!device.is_object()) continue;
    const json role = device.value("role", json());
    if (role != "vibro" && role != "wrench" && role != "taxels") continue;
    if (role == "taxels") limits.taxel_arrays.emplace_back().device = name_of(device);
    if (!device.contains("config")) continue;
    ObjectReader config(device["config"], child("/devices", i) + "/config", problems);
    read_sensor(device, config, limits);
  }
  join_arrays(limits, problems);
  forgo(rig, limits, problems);
  read_noise(rig, limits);
}

bool lacks_noise(const json& rig, std::string_view role) {
  if (!rig.is_object() || !rig.contains("devices") || !rig["devices"].is_array()) return false;
  const json bench = rig.value("bench", json());
  if (bench != "simulated" && bench != "emulated") return false;
  const auto is_zero = [](const json& root, const char* pointer) {
    const json::json_pointer at(pointer);
    return root.contains(at) && root[at].is_number() && root[at] == 0;
  };
  const json::json_pointer kind("/emulator/kind");
  const auto names = [&](const char* key) {
    const json::json_pointer at("/simulation/pads/" + std::string(key));
    return rig.contains(at) && !is_zero(rig, at.to_string().c_str());
  };
  const bool grows = names("noise_per_count") || names("noise_per_square");
  return std::ranges::any_of(rig["devices"], [&](const json& device) {
    if (!device.is_object() || device.value("role", json()) != role) return false;
    if (role == "wrench") return is_zero(device, "/emulator/noise_scale");
    return role == "taxels" && device.contains(kind) && device[kind] == "taxel" &&
           is_zero(rig, "/simulation/pads/noise_counts") && !grows;
  });
}

}  // namespace weft::recipes
