#include "sim/rig/rig_config.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "protocols/base/result.hpp"
#include "protocols/base/time.hpp"
#include "sim/devices/ati_digital_emulator.hpp"
#include "sim/devices/imprint_emulator.hpp"
#include "sim/plant/field_reader.hpp"
#include "sim/rig/taxel_config.hpp"

namespace weft::sim {
namespace {

using nlohmann::json;

/// The level of an imprint scene also selects whether neighbouring taxels share load.
Result<Level> read_level(const std::string& text, const std::string& where) {
  const auto level = level_from(text);
  if (!level)
    return parse_error(where, {.what = level.error().what, .expected = "Z or Z+", .got = text});
  if (Status s = check(Scene{"imprint", {Channel::imprint}, {}}, *level); !s)
    return fail({.code = s.error().code,
                 .where = where,
                 .what = s.error().what,
                 .expected = "Z or Z+",
                 .got = text});
  return *level;
}

/// Errors: parse, range, and unsupported for a level without a static press; below `where`.
Result<ImprintEmulatorParams> read_imprint(const nlohmann::json& emulator,
                                           const std::string& where) {
  ImprintEmulatorParams params;
  std::string level{to_string(params.level)};
  double rate_hz = 5;
  FieldReader reader(emulator, where);
  reader.ignore("kind").text("level", level).number("rate_hz", rate_hz, 0.1, 1000);
  reader.number("full_scale_pa", params.taxels.full_scale_pa, 1, 1e9);
  reader.whole("bits", params.taxels.bits, 1, 7);
  reader.number("hysteresis", params.taxels.hysteresis, 0, 4);
  reader.number("noise_counts", params.taxels.noise_counts, 0, 100);
  reader.whole("serial", params.serial, 0, 4294967295.0);
  reader.whole("largest_chunk_bytes", params.largest_chunk_bytes, 0, 4096);
  if (Status s = reader.finish(); !s) return pass(s.error());
  const auto read = read_level(level, where + "/level");
  if (!read) return pass(read.error());
  params.level = *read;
  params.period_ns = std::llround(1e9 / rate_hz);
  return params;
}

/// Reads the keys of both force sensors; `least_counts` is the lower limit of counts per unit.
void read_sensor(FieldReader& reader, double least_counts, FtSensorParams& sensor) {
  double noise = 1;
  reader.number("counts_per_n", sensor.counts_per_n, least_counts, 1e7);
  reader.number("counts_per_nm", sensor.counts_per_nm, least_counts, 1e7);
  reader.number("plate_mass_kg", sensor.plate_mass_kg, 0, 5);
  reader.number("height_mm", sensor.height_m, 0, 500, m_per_mm);
  reader.number("noise_scale", noise, 0, 1000);
  for (double& component : sensor.noise) component *= noise;
}

/// Errors: parse and range below `where`, a JSON pointer.
Result<AtiDigitalParams> read_digital(const nlohmann::json& emulator, const std::string& where) {
  AtiDigitalParams params;
  std::string framing = "rtu";
  FieldReader reader(emulator, where);
  reader.ignore("kind").text("framing", framing).text("serial", params.serial);
  reader.number("rate_hz", params.rate_hz, 1, 7000).whole("slave", params.slave, 1, 247);
  reader.whole("calibration", params.calibration, 1, protocols::ati_digital::calibrations);
  reader.whole("status_word", params.status_word, 0, 0x3FFF).flag("echo", params.echo);
  read_sensor(reader, 1000, params.sensor);
  if (Status s = reader.finish(); !s) return pass(s.error());
  if (framing != "rtu" && framing != "tcp")
    return parse_error(where + "/framing",
                       {.what = "framing unknown", .expected = "rtu or tcp", .got = framing});
  params.modbus_tcp = framing == "tcp";
  return params;
}

/// Keys of one channel in the rig file, with default rate and block size.
struct ChannelKeys {
  const char* rate_key;
  const char* block_key;
  double rate_hz, block_readings;
  std::size_t axes;
};

/// Sets `converter` to the rate and scales its low-pass in proportion.
Result<VibroChannelParams> sample(const ChannelKeys& keys, std::int64_t step_ns,
                                  ConverterParams& converter, const std::string& where) {
  const auto period_ns = static_cast<std::int64_t>(std::llround(1e9 / keys.rate_hz));
  if (period_ns % step_ns != 0)
    return fail(
        {.code = Errc::range,
         .where = where + "/" + keys.rate_key,
         .what = "rate not available",
         .expected = std::to_string(1'000'000'000 / step_ns) + " Hz divided by a whole number",
         .got = std::to_string(keys.rate_hz) + " Hz"});
  const double values = keys.block_readings * static_cast<double>(keys.axes);
  if (values > static_cast<double>(protocols::vibro::max_values))
    return fail({.code = Errc::range,
                 .where = where + "/" + keys.block_key,
                 .what = "readings of a block exceed a frame",
                 .expected = "at most " + std::to_string(protocols::vibro::max_values / keys.axes),
                 .got = std::to_string(keys.block_readings)});
  converter.bandwidth_hz *=
      static_cast<double>(converter.period_ns) / static_cast<double>(period_ns);
  converter.period_ns = period_ns;
  return VibroChannelParams{period_ns, converter.range, converter.quantum,
                            static_cast<std::uint16_t>(keys.block_readings)};
}

Status sample_all(const ChannelKeys& acceleration, const ChannelKeys& sound,
                  const std::string& where, VibrationParams& plant, VibroEmulatorParams& params) {
  if (acceleration.rate_hz == 0)
    plant.accelerometer.reset();
  else if (auto made = sample(acceleration, plant.step_ns, plant.accelerometer->converter, where))
    params.acceleration = *made;
  else
    return pass(made.error());
  if (sound.rate_hz == 0)
    plant.microphone.reset();
  else if (auto made = sample(sound, plant.step_ns, plant.microphone->converter, where))
    params.sound = *made;
  else
    return pass(made.error());
  return {};
}

/// Configures the plant's sensors, `plant`, to sample as the emulator does; sensors without a rate
/// are left out. Errors: parse and range below `where`, a JSON pointer.
Result<VibroEmulatorParams> read_vibro(const json& emulator, const std::string& where,
                                       VibrationParams& plant) {
  VibroEmulatorParams params;
  plant = {};
  ChannelKeys acceleration{"acceleration_rate_hz", "acceleration_block", 200, 4,
                           protocols::vibro::axes};
  ChannelKeys sound{"sound_rate_hz", "sound_block", 8000, 160, 1};
  std::string form = "stream";
  FieldReader reader(emulator, where);
  reader.ignore("kind").text("form", form).whole("serial", params.serial, 0, 4294967295.0);
  for (ChannelKeys* keys : {&acceleration, &sound}) {
    reader.number(keys->rate_key, keys->rate_hz, 0, 16000);
    reader.number(keys->block_key, keys->block_readings, 1, protocols::vibro::max_values);
  }
  reader.whole("largest_chunk_bytes", params.largest_chunk_bytes, 0, 4096);
  if (Status s = reader.finish(); !s) return pass(s.error());
  if (form != "stream" && form != "datagram")
    return parse_error(where + "/form",
                       {.what = "form unknown", .expected = "stream or datagram", .got = form});
  for (ChannelKeys* keys : {&acceleration, &sound})
    if (keys->rate_hz != 0 && keys->rate_hz < 1)
      return fail({.code = Errc::range,
                   .where = where + "/" + keys->rate_key,
                   .what = "rate too low for vibration",
                   .expected = "0 or 1 to 16000 Hz",
                   .got = std::to_string(keys->rate_hz) + " Hz"});
  if (acceleration.rate_hz == 0 && sound.rate_hz == 0)
    return fail({.code = Errc::range,
                 .where = where + "/sound_rate_hz",
                 .what = "vibration sensor without a channel",
                 .expected = "a rate above 0 for one of them",
                 .got = "0 for both"});
  params.datagrams = form == "datagram";
  if (Status s = sample_all(acceleration, sound, where, plant, params); !s) return pass(s.error());
  return params;
}

constexpr const char* kinds = "apt_stage, rdt, ati_digital, taxel, vibro or imprint";
constexpr std::array<std::string_view, axis_count> axis_roles{"x", "y", "z", "rx", "ry"};

/// Sets scale and serial number from the controller's model. An unknown model gets those of the
/// stage's usual controller.
void take_controller(AptStageParams& params) {
  const auto* controller = protocols::apt::find_controller(params.model);
  if (controller == nullptr)
    controller = protocols::apt::find_controller(params.stage->usual_controller);
  params.serial = controller->serial;
  if (const auto* paired = protocols::apt::find_stage(params.stage->name, params.model))
    params.stage = paired;
}

Status read_controller(FieldReader& reader, const std::string& where, AptStageParams& params) {
  params.model = params.stage->usual_controller;
  constexpr double no_bay = -1;
  std::string firmware = "1.2.3", retarget = "replan";
  double bay = no_bay;
  reader.text("model", params.model).text("retarget", retarget).text("firmware", firmware);
  reader.text("notes", params.notes).flag("enabled", params.enabled);
  reader.flag("encoder", params.encoder).flag("homed", params.homed);
  take_controller(params);
  reader.whole("positive_direction", params.positive_direction, 1, 2);
  reader.whole("serial", params.serial, 0, 999'999'999);
  reader.whole("silent_after", params.silent_after, 0, 1e6);
  reader.number("bay", bay, 0, 9).whole("bays", params.bays, 1, 10);
  int taken = 0;
  unsigned major = 0, interim = 0, minor = 0;
  if (std::sscanf(firmware.c_str(), "%3u.%3u.%3u%n", &major, &interim, &minor, &taken) != 3 ||
      static_cast<std::size_t>(taken) != firmware.size() || std::max({major, interim, minor}) > 255)
    return parse_error(
        where + "/firmware",
        {.what = "version invalid", .expected = "1.2.3, each up to 255", .got = firmware});
  if (retarget != "replan" && retarget != "ignore")
    return parse_error(where + "/retarget",
                       {.what = "policy unknown", .expected = "replan or ignore", .got = retarget});
  if (params.model.empty() || params.model.size() > 8)
    return parse_error(
        where + "/model",
        {.what = "model name invalid", .expected = "1 to 8 characters", .got = params.model});
  params.firmware = {static_cast<std::uint8_t>(major), static_cast<std::uint8_t>(interim),
                     static_cast<std::uint8_t>(minor)};
  params.retarget = retarget == "ignore" ? RetargetPolicy::ignore : RetargetPolicy::replan;
  if (bay != no_bay) params.bay = static_cast<std::uint8_t>(bay);
  return {};
}

Status read_carriage(FieldReader& reader, const protocols::apt::StageModel& model,
                     StageParams& stage) {
  const bool linear = model.axis == protocols::apt::Axis::linear;
  const double si = linear ? m_per_mm : rad_per_deg;
  // Rotary stages turn endlessly; their counter has 32 bits.
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
    return parse_error(
        where, {.what = "role of a stage invalid", .expected = "x, y, z, rx or ry", .got = role});
  AptStageParams params;
  params.axis = static_cast<AxisId>(axis - axis_roles.begin());
  std::string name = "LTS150";
  FieldReader reader(emulator, where);
  reader.ignore("kind").text("stage", name);
  params.stage = protocols::apt::find_stage(name);
  if (params.stage == nullptr)
    return fail({.code = Errc::not_found,
                 .where = where + "/stage",
                 .what = "stage unknown",
                 .expected = "a Thorlabs stage",
                 .got = name});
  const Status controller = read_controller(reader, where, params);
  if (Status s = read_carriage(reader, *params.stage, stage); !s) return pass(s.error());
  if (!controller) return pass(controller.error());
  return params;
}

Result<RdtEmulatorParams> read_box(const json& emulator, const std::string& where) {
  RdtEmulatorParams params;
  FieldReader reader(emulator, where);
  reader.ignore("kind").number("rate_hz", params.rate_hz, 1, 7000);
  reader.whole("records_per_datagram", params.records_per_datagram, 1, 40);
  read_sensor(reader, 1, params.sensor);
  reader.number("threshold_n", params.threshold_n, 0, 1e4);
  reader.text("calibration_serial", params.calibration_serial);
  reader.text("torque_unit", params.torque_unit);
  if (Status s = reader.finish(); !s) return pass(s.error());
  // Only the spelling changes: counts_per_nm keeps its value.
  if (params.torque_unit != "N-m" && params.torque_unit != "Nm")
    return parse_error(
        where + "/torque_unit",
        {.what = "torque unit unknown", .expected = "N-m or Nm", .got = params.torque_unit});
  return params;
}

std::string text_at(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// Reports an unknown emulator; a channel of a device is reported as a channel.
Status no_emulator(const std::string& kind, const std::string& where) {
  if (kind == "accelerometer" || kind == "microphone")
    return parse_error(
        where,
        {.what = "emulator is a channel of a vibration sensor, not a device",
         .expected = "vibro",
         .got = kind,
         .hint =
             "Use vibro, and set acceleration_rate_hz or sound_rate_hz to 0 to omit a channel"});
  return parse_error(where, {.what = "emulator unknown", .expected = kinds, .got = kind});
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
    return parse_error(where, {.what = "value has the wrong type", .expected = "an object"});
  EmulatedDevice out;
  out.name = text_at(device, "name");
  if (out.name.empty()) return parse_error(where + "/name", {.what = "device without a name"});
  const json emulator = device.value("emulator", json::object());
  const Status ok =
      read_emulator(emulator, where + "/emulator", text_at(device, "role"), config, out);
  if (!ok) return pass(ok.error());
  return out;
}

}  // namespace weft::sim
