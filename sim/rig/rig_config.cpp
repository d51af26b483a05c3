#include "sim/rig/rig_config.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>

#include "protocols/base/json_text.hpp"
#include "protocols/base/time.hpp"
#include "sim/plant/fidelity/table.hpp"
#include "sim/plant/field_reader.hpp"

namespace weft::sim {

namespace {

using nlohmann::json;

constexpr std::size_t most_devices = 64;
constexpr std::size_t most_faults = 1000;

/// The value at `key`, or an empty object.
json child_or_empty(const json& object, const char* key) {
  const auto found = object.find(key);
  return found == object.end() ? json::object() : *found;
}

/// Checks the value of one key of a section that other modules also read.
Status shared_number(const json& section, const char* pointer, const char* key, double& value,
                     double low, double high, double to_si) {
  if (!section.is_object() || !section.contains(key)) return {};
  const json alone{{key, section[key]}};
  return FieldReader(alone, pointer).number(key, value, low, high, to_si).finish();
}

/// The force sensor of a device, or nullptr.
FtSensorParams* sensor_of(EmulatedDevice& device) {
  if (auto* box = std::get_if<RdtEmulatorParams>(&device.params)) return &box->sensor;
  auto* digital = std::get_if<AtiDigitalParams>(&device.params);
  return digital == nullptr ? nullptr : &digital->sensor;
}

Status read_plate(const json& plate, RigConfig& config) {
  BenchGeometry& geometry = config.bench_plant.geometry;
  double width_m = 0.15, depth_m = 0.15;
  json known = json::object();
  for (const char* key :
       {"origin_mm", "size_mm", "surface_z_mm", "tilt_axis_y_mm", "tilt_axis_depth_mm"})
    if (plate.is_object() && plate.contains(key)) known[key] = plate[key];
  FieldReader reader(known, "/plate");
  reader.pair("origin_mm", geometry.origin_x_m, geometry.origin_y_m, -1000, 1000, m_per_mm);
  reader.pair("size_mm", width_m, depth_m, 1, 2000, m_per_mm);
  ContactGeometry& contact = config.bench_plant.plant.geometry;
  contact.tilt_axis_y_m = depth_m / 2;
  contact.plate_centre_x_m = width_m / 2;
  reader.required("surface_z_mm", contact.plate_z_m, -1000, 1000, m_per_mm);
  reader.number("tilt_axis_y_mm", contact.tilt_axis_y_m, -1000, 1000, m_per_mm);
  reader.number("tilt_axis_depth_mm", contact.tilt_axis_depth_m, -1000, 1000, m_per_mm);
  for (EmulatedDevice& device : config.devices)
    if (FtSensorParams* sensor = sensor_of(device)) {
      sensor->centre_x_m = width_m / 2;
      sensor->centre_y_m = depth_m / 2;
    }
  return reader.finish();
}

/// The face is square with the area of the footprint.
Status read_footprint(const json& probe, RigConfig& config) {
  if (!probe.is_object() || !probe.contains("footprint_mm")) return {};
  const json alone{{"footprint_mm", probe["footprint_mm"]}};
  double& half_m = config.bench_plant.plant.geometry.face_half_width_m;
  double width_m = 2 * half_m, depth_m = width_m;
  FieldReader reader(alone, "/probe");
  reader.pair("footprint_mm", width_m, depth_m, 1, 1000, m_per_mm);
  if (Status s = reader.finish(); !s) return s;
  half_m = width_m == depth_m ? width_m / 2 : std::sqrt(width_m * depth_m) / 2;
  return {};
}

/// Default slack of the probe's mount [E]; recipes/engine/rig_limits.cpp has the same.
constexpr double default_slack_m = 1e-3;

Status read_probe(const json& probe, RigConfig& config) {
  if (Status s = read_footprint(probe, config); !s) return s;
  if (Status s = shared_number(probe, "/probe", "mass_kg", config.bench_plant.plant.mount.mass_kg,
                               1e-3, 50, 1);
      !s)
    return s;
  if (Status s = shared_number(probe, "/probe", "slack_mm", config.bench_plant.plant.mount.slack_m,
                               0, 50, m_per_mm);
      !s)
    return s;
  return shared_number(probe, "/probe", "tilt_arm_mm", config.bench_plant.geometry.probe_arm_m, 0,
                       10000, m_per_mm);
}

Status read_switches(const json& object, MaterialSwitches& switches) {
  FieldReader reader(object, "/simulation/switches");
  reader.flag("relaxation", switches.relaxation).flag("hysteresis", switches.hysteresis);
  reader.flag("friction", switches.friction).flag("texture", switches.texture);
  reader.flag("waviness", switches.waviness).flag("trial_spread", switches.trial_spread);
  return reader.finish();
}

Status read_dynamics(const json& object, DynamicsParams& dynamics) {
  FieldReader reader(object, "/simulation/dynamics");
  std::string integrator(to_string(dynamics.integrator));
  reader.text("integrator", integrator);
  reader.number("normal_damping", dynamics.normal_damping, 0, 100);
  reader.number("lateral_stiffness_n_m", dynamics.lateral_stiffness_n_m, 1, 1e9);
  reader.number("lateral_damping", dynamics.lateral_damping, 0, 100);
  reader.number("static_ratio", dynamics.static_ratio, 1, 10);
  reader.number("stribeck_speed_mm_s", dynamics.stribeck_speed_mps, 1e-3, 1e4, m_per_mm);
  reader.number("friction_speed_mm_s", dynamics.friction_speed_mps, 0, 1e4, m_per_mm);
  reader.number("bristle_damping", dynamics.bristle_damping, 0, 100);
  reader.number("viscous_n_s_m", dynamics.viscous_n_s_m, 0, 1e4);
  if (Status s = reader.finish(); !s) return s;
  const auto read = integrator_from(integrator);
  if (!read) return parse_error("/simulation/dynamics/integrator", read.error());
  dynamics.integrator = *read;
  return {};
}

Status read_traits(const json& list, std::vector<Trait>& traits) {
  const std::string where = "/simulation/traits";
  if (!list.is_array() || list.size() > all_traits.size())
    return parse_error(
        where, {.what = "list of traits invalid", .expected = "names of traits, each once"});
  for (std::size_t i = 0; i < list.size(); ++i) {
    const std::string at = where + "/" + std::to_string(i);
    if (!list[i].is_string())
      return parse_error(at, {.what = "value has the wrong type", .expected = "a name"});
    const auto trait = trait_from(list[i].get<std::string>());
    if (!trait) return parse_error(at, trait.error());
    if (std::find(traits.begin(), traits.end(), *trait) != traits.end())
      return parse_error(at, {.what = "trait listed twice", .got = std::string(name_of(*trait))});
    traits.push_back(*trait);
  }
  return {};
}

Status read_level(const std::string& text, RigConfig& config) {
  Level& level = config.bench_plant.plant.level;
  if (text == "auto") {
    const auto least = least_level(config.scene);
    if (!least) return fail_at(level_place, least.error());
    level = *least;
    return {};
  }
  const auto named = level_from(text);
  if (!named)
    return parse_error(
        level_place,
        {.what = named.error().what, .expected = "auto, " + named.error().expected, .got = text});
  if (Status s = check(config.scene, *named); !s) return fail_at(level_place, s.error());
  level = *named;
  config.level_by_hand = true;
  return {};
}

/// Reads the choice that an earlier run recorded.
Status read_chosen(const json& object, RigConfig& config) {
  FieldReader reader(object, "/simulation/chosen");
  reader.text("setting", config.chosen_setting).text("because", config.chosen_because);
  if (Status s = reader.finish(); !s) return s;
  const auto control = [](char c) { return std::iscntrl(static_cast<unsigned char>(c)) != 0; };
  if (std::ranges::none_of(config.chosen_because, control)) return {};
  return parse_error("/simulation/chosen/because",
                     {.what = "text with control characters", .expected = "no control characters"});
}

/// Reads the keys of `simulation` that set the fidelity.
Status read_fidelity(FieldReader& reader, RigConfig& config) {
  PlantParams& plant = config.bench_plant.plant;
  std::string level = "auto";
  double step_s = 0;
  reader.text("level", level).number("step_us", step_s, 1, 50000, 1e-6);
  const json* traits = reader.child("traits");
  const json* chosen = reader.child("chosen");
  const double unset_n = -1;
  double set_point_n = unset_n;
  reader.number("set_point_n", set_point_n, 0.01, 1000);
  if (step_s > 0) {
    plant.dynamics.step_s = plant.quasistatic_step_s = step_s;
    plant.dynamics.integrator = Integrator::midpoint;  // equal steps, unless another one is named
  }
  config.set_point_by_hand = set_point_n != unset_n;
  if (config.set_point_by_hand) plant.set_point_n = set_point_n;
  if (traits != nullptr)
    if (Status s = read_traits(*traits, config.scene.traits); !s) return s;
  if (chosen != nullptr)
    if (Status s = read_chosen(*chosen, config); !s) return s;
  return read_level(level, config);
}

Status read_faults(const json& list, RigConfig& config) {
  const std::string where = "/simulation/faults";
  if (!list.is_array() || list.size() > most_faults)
    return parse_error(where,
                       {.what = "list of faults invalid", .expected = "at most 1000 faults"});
  for (std::size_t i = 0; i < list.size(); ++i) {
    auto fault = read_fault(list[i], where + "/" + std::to_string(i), config.devices, {});
    if (!fault) return pass(fault.error());
    config.faults.push_back(std::move(*fault));
  }
  return {};
}

Status read_simulation(const json& object, RigConfig& config) {
  PlantParams& plant = config.bench_plant.plant;
  FieldReader reader(object, "/simulation");
  reader.ignore("fabrics").ignore("fidelity").ignore("note").ignore("console");
  reader.number("mount_stiffness_n_m", plant.mount.stiffness_n_m, 1, 1e9);
  reader.number("stop_stiffness_n_m", plant.mount.stop_stiffness_n_m, 1, 1e9);
  reader.number("slack_mm", plant.mount.slack_m, 0, 50, m_per_mm);
  reader.number("rig_tilt_mrad", plant.rig_tilt, 0, 100, 1e-3);
  reader.number("cover_um", plant.cover.lambda_m, 0, 1000, m_per_um);
  reader.number("cover_pressure_Pa", plant.cover.pressure_pa, 1, 1e6);
  reader.pair("plate_tilt_deg", plant.geometry.plate_tilt_x_rad, plant.geometry.plate_tilt_y_rad,
              -30, 30, rad_per_deg);
  const json* dynamics = reader.child("dynamics");
  const json* pads = reader.child("pads");
  const json* switches = reader.child("switches");
  const json* faults = reader.child("faults");
  const Status fidelity = read_fidelity(reader, config);
  if (Status s = reader.finish(); !s) return s;
  if (!fidelity) return fidelity;
  if (dynamics != nullptr)
    if (Status s = read_dynamics(*dynamics, plant.dynamics); !s) return s;
  if (pads != nullptr) {
    FieldReader pad_reader(*pads, "/simulation/pads");
    if (pads->is_object() && pads->value("noise_counts", json()) == 0)  // no noise of any kind
      plant.pads.noise_per_count = plant.pads.noise_per_square = 0;
    if (Status s = read_pads(pad_reader, plant.pads); !s) return s;
  }
  if (switches != nullptr)
    if (Status s = read_switches(*switches, config.switches); !s) return s;
  // Pads measure the texture; at level L3 rubbing on it causes vibrations.
  if (!plant.watched.pads && plant.level < Level::modal) config.switches.texture = false;
  if (faults != nullptr) return read_faults(*faults, config);
  return {};
}

bool is_imprint(const EmulatedDevice& device) {
  return std::holds_alternative<ImprintEmulatorParams>(device.params);
}

std::vector<Channel> channels_of(const EmulatedDevice& device) {
  if (std::holds_alternative<AptStageParams>(device.params)) return {Channel::stages};
  if (std::holds_alternative<TaxelEmulatorParams>(device.params)) return {Channel::taxels};
  if (is_imprint(device)) return {};  // a scene of its own, at its own level
  const auto* vibro = std::get_if<VibroEmulatorParams>(&device.params);
  if (vibro == nullptr) return {Channel::wrench};
  std::vector<Channel> channels;
  if (vibro->acceleration.period_ns > 0) channels.push_back(Channel::accelerometer);
  if (vibro->sound.period_ns > 0) channels.push_back(Channel::microphone);
  return channels;
}

/// Collects the scene's channels and limits the plant to what they need.
void watch(RigConfig& config) {
  std::vector<Channel>& channels = config.scene.channels;
  for (const EmulatedDevice& device : config.devices)
    for (const Channel channel : channels_of(device))
      if (!is_needed(config.scene, channel)) channels.push_back(channel);
  std::sort(channels.begin(), channels.end());
  Watched& watched = config.bench_plant.plant.watched;
  watched.pads = is_needed(config.scene, Channel::taxels);
  watched.contact = watched.pads || is_needed(config.scene, Channel::wrench) ||
                    std::ranges::any_of(config.devices, is_imprint);
  const bool vibrations = is_needed(config.scene, Channel::accelerometer) ||
                          is_needed(config.scene, Channel::microphone);
  if (vibrations) {
    config.scene.name = "vibrotactile";
    watched.contact = true;  // the source of the vibrations
  }
  VibrationParams& vibration = config.bench_plant.plant.vibration;
  if (!is_needed(config.scene, Channel::accelerometer)) vibration.accelerometer.reset();
  if (!is_needed(config.scene, Channel::microphone)) vibration.microphone.reset();
}

bool is_vibro(const EmulatedDevice& device) {
  return std::holds_alternative<VibroEmulatorParams>(device.params);
}

Status read_devices(const json& devices, RigConfig& config) {
  if (!devices.is_array() || devices.size() > most_devices)
    return parse_error("/devices",
                       {.what = "list of devices invalid", .expected = "at most 64 devices"});
  for (std::size_t i = 0; i < devices.size(); ++i) {
    auto device = read_device(devices[i], "/devices/" + std::to_string(i), config);
    if (!device) return pass(device.error());
    for (const EmulatedDevice& other : config.devices)
      if (other.name == device->name)
        return parse_error("/devices/" + std::to_string(i) + "/name",
                           {.what = "device name used twice", .got = device->name});
      else if (is_vibro(other) && is_vibro(*device))
        return fail({.code = Errc::unsupported,
                     .where = "/devices/" + std::to_string(i),
                     .what = "too many vibration sensors",
                     .expected = "one device of kind vibro",
                     .got = "two"});
    config.devices.push_back(std::move(*device));
  }
  return {};
}

/// Axes without a stage are at the positions of `fixed`.
Status read_fixed(const json& fixed, RigConfig& config) {
  constexpr struct {
    const char *usual, *si;
    AxisId axis;
    double per_usual, most;
  } axes[]{{"y_mm", "y_m", AxisId::y, m_per_mm, 10},
           {"rx_deg", "rx_rad", AxisId::rx, rad_per_deg, 1.5},
           {"ry_deg", "ry_rad", AxisId::ry, rad_per_deg, 1.5}};
  FieldReader reader(fixed, "/fixed");
  for (const auto& each : axes) {
    StageParams& stage = config.bench_plant.stages[static_cast<std::size_t>(each.axis)];
    reader.number(each.usual, stage.start, -each.most / each.per_usual, each.most / each.per_usual,
                  each.per_usual);
    reader.number(each.si, stage.start, -each.most, each.most);
  }
  return reader.finish();
}

}  // namespace

Result<RigConfig> parse_rig_config(std::string_view rig_json, const SensorParams& sensor) {
  const Result<json> document = parse_json(rig_json);
  if (!document) return pass(document.error(), "rig file");
  const json& rig = *document;
  if (!rig.is_object())
    return parse_error("rig file", {.what = "value has the wrong type", .expected = "an object"});
  RigConfig config;
  config.bench_plant.plant.mount.slack_m = default_slack_m;
  config.bench_plant.plant.cover = sensor.cover;
  config.bench_plant.plant.pads = sensor.pads;
  if (Status s = read_devices(child_or_empty(rig, "devices"), config); !s) return pass(s.error());
  if (Status s = read_fixed(child_or_empty(rig, "fixed"), config); !s) return pass(s.error());
  watch(config);
  if (Status s = read_plate(child_or_empty(rig, "plate"), config); !s) return pass(s.error());
  if (Status s = read_probe(child_or_empty(rig, "probe"), config); !s) return pass(s.error());
  if (Status s = read_simulation(child_or_empty(rig, "simulation"), config); !s)
    return pass(s.error());
  return config;
}

}  // namespace weft::sim
