#include "sim/rig/device_config.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"
#include "sim/devices/ati_digital_emulator.hpp"
#include "sim/devices/imprint_emulator.hpp"
#include "sim/plant/field_reader.hpp"
#include "sim/plant/scene/scene.hpp"

namespace weft::sim {
namespace {

using nlohmann::json;

/// Also what shares load between neighbours is a choice of the scene's, by its level.
Result<Level> read_level(const std::string& text, const std::string& where) {
  const auto level = level_from(text);
  if (!level)
    return fail({.code = Errc::parse,
                 .where = where,
                 .what = level.error().what,
                 .expected = "Z or Z+",
                 .got = text});
  if (Status s = check(Scene{"imprint", {Channel::imprint}, {}}, *level); !s)
    return fail({.code = s.error().code,
                 .where = where,
                 .what = s.error().what,
                 .expected = "Z or Z+",
                 .got = text});
  return *level;
}

/// Errors: parse, range, and unsupported for a level that does not press statically; below `where`.
Result<ImprintEmulatorParams> read_imprint(const nlohmann::json& emulator,
                                           const std::string& where) {
  ImprintEmulatorParams params;
  std::string kind, level{to_string(params.level)};
  double rate_hz = 5, serial = params.serial, bits = params.taxels.bits, chunk = 0;
  FieldReader reader(emulator, where);
  reader.text("kind", kind).text("level", level).number("rate_hz", rate_hz, 0.1, 1000);
  reader.number("full_scale_pa", params.taxels.full_scale_pa, 1, 1e9).number("bits", bits, 1, 7);
  reader.number("hysteresis", params.taxels.hysteresis, 0, 4);
  reader.number("noise_counts", params.taxels.noise_counts, 0, 100);
  reader.number("serial", serial, 0, 4294967295.0).number("largest_chunk_bytes", chunk, 0, 4096);
  if (Status s = reader.finish(); !s) return pass(s.error());
  const auto read = read_level(level, where + "/level");
  if (!read) return pass(read.error());
  params.level = *read;
  params.taxels.bits = static_cast<int>(bits);
  params.period_ns = std::llround(1e9 / rate_hz);
  params.serial = static_cast<std::uint32_t>(serial);
  params.largest_chunk_bytes = static_cast<std::size_t>(chunk);
  return params;
}

/// Errors: parse and range below `where`, a JSON pointer.
Result<AtiDigitalParams> read_digital(const nlohmann::json& emulator, const std::string& where) {
  AtiDigitalParams params;
  FtSensorParams& sensor = params.sensor;
  std::string kind, framing = "rtu";
  double slave = params.slave, calibration = params.calibration, status = 0, noise = 1;
  FieldReader reader(emulator, where);
  reader.text("kind", kind).text("framing", framing).text("serial", params.serial);
  reader.number("rate_hz", params.rate_hz, 1, 7000).number("slave", slave, 1, 247);
  reader.number("calibration", calibration, 1, protocols::ati_digital::calibrations);
  reader.number("status_word", status, 0, 0x3FFF);
  reader.number("counts_per_n", sensor.counts_per_n, 1000, 1e7);
  reader.number("counts_per_nm", sensor.counts_per_nm, 1000, 1e7);
  reader.number("plate_mass_kg", sensor.plate_mass_kg, 0, 5);
  reader.number("height_mm", sensor.height_m, 0, 500, m_per_mm);
  reader.number("noise_scale", noise, 0, 1000);
  if (Status s = reader.finish(); !s) return pass(s.error());
  if (framing != "rtu" && framing != "tcp")
    return fail({.code = Errc::parse,
                 .where = where + "/framing",
                 .what = "no such framing",
                 .expected = "rtu or tcp",
                 .got = framing});
  params.modbus_tcp = framing == "tcp";
  params.slave = static_cast<std::uint8_t>(slave);
  params.calibration = static_cast<int>(calibration);
  params.status_word = static_cast<std::uint16_t>(status);
  for (double& component : sensor.noise) component *= noise;
  return params;
}

constexpr const char* kinds = "apt_stage, rdt, ati_digital, taxel, vibro or imprint";
constexpr std::array<std::string_view, axis_count> axis_roles{"x", "y", "z", "rx", "ry"};

/// The controller that a stage usually has, and serial numbers as it has them (device-facts.md,
/// APT line).
struct Controller {
  std::string_view stage, model;
  std::int32_t serial;
};
constexpr std::array controllers{
    Controller{"LTS150", "LTS150", 45000001}, Controller{"NRT150", "SCC201", 40000001},
    Controller{"PRM1-Z8", "KDC101", 27000001}, Controller{"CR1-Z7", "TDC001", 83000001},
    Controller{"K10CR1", "K10CR1", 55000001}};

Status read_controller(FieldReader& reader, const std::string& where, AptStageParams& params) {
  const auto* usual =
      std::find_if(controllers.begin(), controllers.end(),
                   [&](const Controller& c) { return c.stage == params.stage->name; });
  if (usual != controllers.end()) {
    params.model = usual->model;
    params.serial = usual->serial;
  }
  constexpr double no_bay = -1;
  std::string firmware = "1.2.3", retarget = "replan";
  double serial = params.serial, silent_after = params.silent_after, bay = no_bay;
  double bays = params.bays;
  reader.text("model", params.model).text("retarget", retarget).text("firmware", firmware);
  reader.text("notes", params.notes).flag("enabled", params.enabled);
  reader.flag("encoder", params.encoder);
  reader.number("serial", serial, 0, 99'999'999).number("silent_after", silent_after, 0, 1e6);
  reader.number("bay", bay, 0, 9).number("bays", bays, 1, 10);
  int taken = 0;
  unsigned major = 0, interim = 0, minor = 0;
  if (std::sscanf(firmware.c_str(), "%3u.%3u.%3u%n", &major, &interim, &minor, &taken) != 3 ||
      static_cast<std::size_t>(taken) != firmware.size() || std::max({major, interim, minor}) > 255)
    return fail({.code = Errc::parse,
                 .where = where + "/firmware",
                 .what = "not a version",
                 .expected = "1.2.3, each up to 255",
                 .got = firmware});
  if (retarget != "replan" && retarget != "ignore")
    return fail({.code = Errc::parse,
                 .where = where + "/retarget",
                 .what = "no such policy",
                 .expected = "replan or ignore",
                 .got = retarget});
  if (params.model.empty() || params.model.size() > 8)
    return fail({.code = Errc::parse,
                 .where = where + "/model",
                 .what = "not a model name",
                 .expected = "1 to 8 characters",
                 .got = params.model});
  params.firmware = {static_cast<std::uint8_t>(major), static_cast<std::uint8_t>(interim),
                     static_cast<std::uint8_t>(minor)};
  params.serial = static_cast<std::int32_t>(serial);
  params.silent_after = static_cast<std::uint32_t>(silent_after);
  params.retarget = retarget == "ignore" ? RetargetPolicy::ignore : RetargetPolicy::replan;
  params.bays = static_cast<std::uint8_t>(bays);
  if (bay != no_bay) params.bay = static_cast<std::uint8_t>(bay);
  return {};
}

Status read_carriage(FieldReader& reader, const protocols::apt::StageModel& model,
                     StageParams& stage) {
  const bool linear = model.axis == protocols::apt::Axis::linear;
  const double si = linear ? m_per_mm : rad_per_deg;
  // Rotary stages turn without end; their counter has 32 bits.
  const double counter_end = std::numeric_limits<std::int32_t>::max() / model.scale.counts_per_unit;
  const double span = linear ? 1000 : std::min(36000.0, std::floor(counter_end));
  double quantum = 1, backlash = 0;
  stage.low = (linear ? model.travel_low : -span) * si;
  stage.high = (linear ? model.travel_high : span) * si;
  reader.interval(linear ? "travel_mm" : "travel_deg", stage.low, stage.high, -span, span, si);
  reader.number(linear ? "start_mm" : "start_deg", stage.start, -span, span, si);
  reader.number(linear ? "quantum_um" : "quantum_urad", quantum, 0, 1e4);
  reader.number(linear ? "backlash_um" : "backlash_urad", backlash, 0, 1e4);
  if (Status s = reader.finish(); !s) return s;
  stage.quantum = quantum * 1e-6;
  stage.backlash = backlash * 1e-6;
  stage.start = std::clamp(stage.start, stage.low, stage.high);
  return {};
}

Result<AptStageParams> read_stage(const json& emulator, const std::string& where,
                                  const std::string& role, StageParams& stage) {
  const auto axis = std::find(axis_roles.begin(), axis_roles.end(), role);
  if (axis == axis_roles.end())
    return fail({.code = Errc::parse,
                 .where = where,
                 .what = "a stage needs an axis as its role",
                 .expected = "x, y, z, rx or ry",
                 .got = role});
  AptStageParams params;
  params.axis = static_cast<AxisId>(axis - axis_roles.begin());
  std::string kind, name = "LTS150";
  FieldReader reader(emulator, where);
  reader.text("kind", kind).text("stage", name);
  params.stage = protocols::apt::find_stage(name);
  if (params.stage == nullptr)
    return fail({.code = Errc::not_found,
                 .where = where + "/stage",
                 .what = "no such stage",
                 .expected = "a Thorlabs stage",
                 .got = name});
  const Status controller = read_controller(reader, where, params);
  if (Status s = read_carriage(reader, *params.stage, stage); !s) return pass(s.error());
  if (!controller) return pass(controller.error());
  return params;
}

Result<RdtEmulatorParams> read_box(const json& emulator, const std::string& where) {
  RdtEmulatorParams params;
  std::string kind;
  double per_datagram = 10, noise = 1;
  FieldReader reader(emulator, where);
  reader.text("kind", kind).number("rate_hz", params.rate_hz, 1, 7000);
  reader.number("records_per_datagram", per_datagram, 1, 40);
  reader.number("counts_per_n", params.sensor.counts_per_n, 1, 1e7);
  reader.number("counts_per_nm", params.sensor.counts_per_nm, 1, 1e7);
  reader.number("plate_mass_kg", params.sensor.plate_mass_kg, 0, 5);
  reader.number("height_mm", params.sensor.height_m, 0, 500, m_per_mm);
  reader.number("noise_scale", noise, 0, 1000);
  reader.number("threshold_n", params.threshold_n, 0, 1e4);
  reader.text("calibration_serial", params.calibration_serial);
  reader.text("torque_unit", params.torque_unit);
  if (Status s = reader.finish(); !s) return pass(s.error());
  // A spelling, not a unit: counts_per_nm stays what it is.
  if (params.torque_unit != "N-m" && params.torque_unit != "Nm")
    return fail({.code = Errc::parse,
                 .where = where + "/torque_unit",
                 .what = "no such spelling",
                 .expected = "N-m or Nm",
                 .got = params.torque_unit});
  params.records_per_datagram = static_cast<std::size_t>(per_datagram);
  for (double& component : params.sensor.noise) component *= noise;
  return params;
}

Result<TaxelEmulatorParams> read_taxels(const json& emulator, const std::string& where) {
  TaxelEmulatorParams params;
  std::string kind, form = "weft";
  double chunk = 0;
  FieldReader reader(emulator, where);
  reader.text("kind", kind).text("form", form).number("largest_chunk_bytes", chunk, 0, 4096);
  if (Status s = reader.finish(); !s) return pass(s.error());
  if (form != "weft" && form != "cpm_udp")
    return fail({.code = Errc::parse,
                 .where = where + "/form",
                 .what = "no such form",
                 .expected = "weft or cpm_udp",
                 .got = form});
  params.wire = form == "weft" ? TaxelWire::weft : TaxelWire::cpm_udp;
  params.largest_chunk_bytes = static_cast<std::size_t>(chunk);
  return params;
}

std::string text_at(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// Channels of a device are named as such.
Status no_emulator(const std::string& kind, const std::string& where) {
  if (kind == "accelerometer" || kind == "microphone")
    return fail({.code = Errc::parse,
                 .where = where,
                 .what = "a channel of a vibration sensor, not a device",
                 .expected = "vibro",
                 .got = kind,
                 .hint = "acceleration_rate_hz or sound_rate_hz 0 leaves the other channel out"});
  return fail({.code = Errc::parse,
               .where = where,
               .what = "no such emulator",
               .expected = kinds,
               .got = kind});
}

template <class Params>
Status put(Result<Params> params, EmulatedDevice& device) {
  if (!params) return pass(params.error());
  device.params = std::move(*params);
  return {};
}

Status read_axis(const json& emulator, const std::string& where, const std::string& role,
                 RigConfig& config, EmulatedDevice& device) {
  StageParams stage;
  auto params = read_stage(emulator, where, role, stage);
  if (!params) return pass(params.error());
  config.bench_plant.stages[static_cast<std::size_t>(params->axis)] = stage;
  device.params = *params;
  return {};
}

Status read_emulator(const json& emulator, const std::string& where, const std::string& role,
                     RigConfig& config, EmulatedDevice& device) {
  const std::string kind = text_at(emulator, "kind");
  if (kind == "apt_stage") return read_axis(emulator, where, role, config, device);
  if (kind == "rdt") return put(read_box(emulator, where), device);
  if (kind == "ati_digital") return put(read_digital(emulator, where), device);
  if (kind == "taxel") return put(read_taxels(emulator, where), device);
  if (kind == "vibro")
    return put(read_vibro(emulator, where, config.bench_plant.plant.vibration), device);
  if (kind == "imprint") return put(read_imprint(emulator, where), device);
  return no_emulator(kind, where + "/kind");
}

}  // namespace

Result<EmulatedDevice> read_device(const json& device, const std::string& where,
                                   RigConfig& config) {
  if (!device.is_object())
    return fail(
        {.code = Errc::parse, .where = where, .what = "not a device", .expected = "an object"});
  EmulatedDevice out;
  out.name = text_at(device, "name");
  if (out.name.empty())
    return fail({.code = Errc::parse, .where = where + "/name", .what = "a device without a name"});
  const json emulator = device.value("emulator", json::object());
  const Status ok =
      read_emulator(emulator, where + "/emulator", text_at(device, "role"), config, out);
  if (!ok) return pass(ok.error());
  return out;
}

}  // namespace weft::sim
