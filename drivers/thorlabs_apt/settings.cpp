#include "drivers/thorlabs_apt/settings.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>

#include "drivers/api/config.hpp"
#include "protocols/base/time.hpp"

namespace weft::drivers {
namespace {

using protocols::apt::Axis;
using protocols::apt::Family;
using protocols::apt::HardwareInfo;
using protocols::apt::StageModel;
using protocols::apt::StageScale;

constexpr double encoder_tolerance = 0.1;  // mm or degrees

double si_per_unit(const StageModel& model) {
  return model.axis == Axis::linear ? m_per_mm : rad_per_deg;
}

StageScale per_si(const StageScale& scale, double si) {
  return {scale.counts_per_unit / si, scale.velocity_counts / si, scale.acceleration_counts / si};
}

Family read_family(ConfigReader& config, const StageModel& model) {
  const std::string_view usual = model.family == Family::servo ? "servo" : "stepper";
  return config.choice("family", usual, {"stepper", "servo"}) == "servo" ? Family::servo
                                                                         : Family::stepper;
}

// Never fails: the limits of all stages of the table are far inside the 32-bit fields.
std::int32_t counts_of(Result<std::int32_t> counts) {
  WEFT_ASSERT(counts.has_value());
  return *counts;
}

struct Names {
  std::string max_speed, acceleration, travel;
};

Names names_for(const StageModel& model) {
  const std::string unit = model.axis == Axis::linear ? "mm" : "deg";
  return {"max_speed_" + unit + "_s", "acceleration_" + unit + "_s2", "travel_" + unit};
}

void read_limits(ConfigReader& config, StageSettings& settings) {
  const StageModel& model = *settings.model;
  const Names names = names_for(model);
  const double si = si_per_unit(model);
  const double speed = config.number(names.max_speed, model.max_speed, {1e-3, model.max_speed});
  const double acceleration =
      config.number(names.acceleration, model.default_acceleration, {0.1, model.max_acceleration});
  // A rotary stage turns both ways from home; a linear one has its switch at home.
  const double lowest = model.axis == Axis::rotary ? -model.travel_high : model.travel_low;
  const std::vector<double> travel = config.numbers(
      names.travel, {model.travel_low, model.travel_high}, {lowest, model.travel_high});
  if (travel[0] >= travel[1])
    config.refuse(names.travel, "travel empty", "[low, high] with low below high");
  settings.max_speed = speed * si;
  settings.acceleration = acceleration * si;
  const StageScale& scale = model.scale;
  settings.max_velocity_counts = counts_of(velocity_to_counts(scale, speed));
  settings.default_velocity_counts =
      counts_of(velocity_to_counts(scale, std::min(model.default_speed, speed)));
  settings.acceleration_counts = counts_of(acceleration_to_counts(scale, acceleration));
  settings.travel_low_counts = counts_of(position_to_counts(scale, travel[0]));
  settings.travel_high_counts = counts_of(position_to_counts(scale, travel[1]));
}

// Time over the full travel (or a full turn) at homing speed, plus half for ramps and the second
// approach to the switch, plus ten seconds.
double home_time_limit_s(const StageModel& model) {
  const double way = model.travel_high - model.travel_low + model.home_offset;
  return 1.5 * way / model.home_speed + 10;
}

void read_timing(ConfigReader& config, StageSettings& settings) {
  settings.home_timeout = from_seconds(
      config.number("home_timeout_s", home_time_limit_s(*settings.model), {0.1, 3600}));
  settings.reply_timeout = from_seconds(config.number("reply_timeout_s", 1, {0.01, 60}));
  const double poll_hz = config.number("poll_hz", 0, {0, 1000});
  if (poll_hz > 0) settings.poll_period = from_seconds(1 / poll_hz);
}

/// Whether a controller of this model has the scale of `stage`. Errors: device_identity, with the
/// suitable controllers.
Status check_scale(const StageModel& stage, std::string_view model) {
  const StageModel* known = protocols::apt::find_stage(stage.name, model);
  if (known != nullptr && known->scale == stage.scale) return {};
  std::string others;
  for (const protocols::apt::Pairing& pairing : protocols::apt::stage_pairings())
    if (pairing.stage == stage.name && pairing.scale == stage.scale)
      others += (others.empty() ? "" : ", ") + std::string(pairing.name);
  return fail(
      {.code = Errc::device_identity,
       .what = "scale of " + std::string(stage.name) + " on this controller unknown",
       .expected = others,
       .got = std::string(model),
       .hint =
           known == nullptr
               ? "Use a controller from the list; the counts of this one may have another length"
               : "State it as `controller` in the rig file, or use a controller from the list"});
}

/// The stage with the scale of the controller in the rig file, or of its usual controller.
const StageModel& read_model(ConfigReader& config) {
  std::vector<std::string_view> names;
  for (const StageModel& model : protocols::apt::stage_models()) names.push_back(model.name);
  const std::string name = config.choice("stage", names.front(), names);
  const StageModel& usual = *protocols::apt::find_stage(name);
  const std::string stated = config.text("controller", "", 8);
  if (stated.empty()) return usual;
  const StageModel* paired = protocols::apt::find_stage(name, stated);
  if (paired != nullptr) return *paired;
  const Error unknown = check_scale(usual, stated).error();
  config.refuse("controller", unknown.what, unknown.expected, unknown.got);
  return usual;
}

/// Refuses settings that open() would refuse on an emulated unit.
void read_emulated(ConfigReader& config, const StageSettings& settings) {
  std::string model = config.text("emulated_controller", "", 8);
  const StageModel* stage = protocols::apt::find_stage(config.text("emulated_stage", "", 16));
  if (model.empty() && stage != nullptr) model = stage->usual_controller;
  if (model.empty()) return;
  StageSettings any_unit = settings;
  any_unit.serial = 0;
  HardwareInfo info;
  info.model = protocols::apt::Text<8>::from(model);
  if (stage != nullptr) info.stage_id = stage->stage_id;
  if (const Status same = check_identity(any_unit, info); !same)
    config.refuse("stage", same.error().what, same.error().expected, same.error().got);
}

// Stage ids of KDC101/TDC001 (device-facts.md, APT info reply): 1 is none, 12 a stage of another
// maker.
constexpr bool names_a_stage(std::uint16_t stage_id) {
  return stage_id >= 2 && stage_id <= 11;
}

}  // namespace

std::string StageSettings::with_unit(double si) const {
  char text[384];  // the largest double has 309 digits
  std::snprintf(text, sizeof text, "%.4f %s", si / si_per_unit(*model),
                model->axis == Axis::linear ? "mm" : "deg");
  return text;
}

const char stage_config_schema[] = R"({
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "title": "Thorlabs stage behind an APT controller",
  "type": "object",
  "additionalProperties": false,
  "properties": {
    "stage": {"enum": ["LTS150", "LTS300", "NRT100", "NRT150", "MTS25-Z8", "MTS50-Z8", "Z806", "Z812", "Z825", "Z606", "Z612", "Z625", "DDSM100", "DDS220", "DDS300", "DDS600", "MLS203", "PRM1-Z8", "CR1-Z7", "K10CR1", "HDR50", "NR360"], "default": "LTS150", "description": "name of the stage; see the table below"},
    "controller": {"type": "string", "maxLength": 8, "x-safety": true, "description": "model reported by the controller, such as BSC201; it sets the counts per mm, and a model with an unknown scale for the stage is refused; default: a controller with the usual scale of the stage"},
    "emulated_controller": {"type": "string", "maxLength": 8, "description": "set by Weft from the emulator in the rig file; compared as the model of a real unit"},
    "emulated_stage": {"type": "string", "maxLength": 16, "description": "the same for the stage"},
    "family": {"enum": ["stepper", "servo"], "description": "kind of status messages of the controller; default: by the stage"},
    "channel": {"type": "integer", "minimum": 1, "maximum": 8, "default": 1},
    "destination": {"type": "integer", "minimum": 17, "maximum": 80, "default": 80, "description": "80 (0x50): USB unit; 33 (0x21): bay 0"},
    "max_speed_mm_s": {"x-unit": "mm/s", "x-safety": true, "type": "number", "exclusiveMinimum": 0, "description": "linear stages; default: the limit of the stage"},
    "max_speed_deg_s": {"x-unit": "deg/s", "x-safety": true, "type": "number", "exclusiveMinimum": 0, "description": "rotary stages"},
    "acceleration_mm_s2": {"x-unit": "mm/s2", "x-safety": true, "type": "number", "exclusiveMinimum": 0, "description": "linear stages; default: limits.acceleration_mm_s2 of the rig; any other value is refused"},
    "acceleration_deg_s2": {"x-unit": "deg/s2", "x-safety": true, "type": "number", "exclusiveMinimum": 0, "description": "rotary stages"},
    "travel_mm": {"x-unit": "mm", "x-safety": true, "type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2, "description": "linear stages: [low, high] from home"},
    "travel_deg": {"x-unit": "deg", "x-safety": true, "type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2, "description": "rotary stages: [low, high] from home"},
    "in_position_counts": {"type": "integer", "minimum": 0, "maximum": 10000, "default": 4, "description": "largest distance from the target at the end of a move"},
    "require_homed": {"x-safety": true, "type": "boolean", "default": true, "description": "refuse motion before homing"},
    "serial": {"type": "integer", "minimum": 0, "maximum": 999999999, "default": 0, "description": "serial number of the unit; any other is refused; 0: any"},
    "identify": {"type": "boolean", "default": false, "description": "flash the front panel on opening"},
    "encoder": {"x-safety": true, "type": "boolean", "default": false, "description": "for a stepper that reports an encoder count in its status; lost steps are a fault"},
    "check_jumps": {"x-safety": true, "type": "boolean", "default": true, "description": "drop positions that no motion explains; three in a row are a fault"},
    "home_must_move": {"x-safety": true, "type": "boolean", "default": true, "description": "homing without a change of position is a fault"},
    "home_timeout_s": {"x-unit": "s", "type": "number", "minimum": 0.1, "maximum": 3600, "description": "longest homing; default by the stage: 1.5 x (travel + offset) / homing speed + 10"},
    "reply_timeout_s": {"x-unit": "s", "type": "number", "minimum": 0.01, "maximum": 60, "default": 1},
    "poll_hz": {"x-unit": "Hz", "type": "number", "minimum": 0, "maximum": 1000, "default": 0, "description": "rate of automatic status readings; 0: only on PollCommand"}
  }
})";

Result<StageSettings> read_stage_settings(std::string_view config_json) {
  ConfigReader config(config_json);
  StageSettings settings;
  settings.model = &read_model(config);
  settings.family = read_family(config, *settings.model);
  settings.scale = per_si(settings.model->scale, si_per_unit(*settings.model));
  settings.channel = static_cast<std::uint8_t>(config.integer("channel", 1, {1, 8}));
  settings.destination =
      static_cast<std::uint8_t>(config.integer("destination", 0x50, {0x11, 0x50}));
  settings.in_position_counts =
      static_cast<std::int32_t>(config.integer("in_position_counts", 4, {0, 10000}));
  settings.require_homed = config.flag("require_homed", true);
  settings.serial = static_cast<std::int32_t>(config.integer("serial", 0, {0, 999'999'999}));
  settings.identify = config.flag("identify", false);
  settings.encoder = config.flag("encoder", false);
  settings.encoder_tolerance_counts =
      static_cast<std::int32_t>(encoder_tolerance * settings.model->scale.counts_per_unit);
  settings.check_jumps = config.flag("check_jumps", true);
  settings.home_must_move = config.flag("home_must_move", true);
  read_limits(config, settings);
  read_timing(config, settings);
  read_emulated(config, settings);
  if (Status status = config.finish(); !status) return pass(status.error());
  return settings;
}

Status check_identity(const StageSettings& settings, const HardwareInfo& info) {
  const std::string model = info.model.str();
  const std::string stage(settings.model->name);
  const char* hint = "Check port and stage in the rig file";
  const protocols::apt::Controller* controller = protocols::apt::find_controller(model);
  if (controller == nullptr || controller->family != settings.family)
    return fail({.code = Errc::device_identity,
                 .what = "controller of the wrong kind",
                 .expected = settings.family == Family::servo
                                 ? "a DC servo controller such as KDC101"
                                 : "a stepper controller such as LTS150",
                 .got = '"' + model + '"',
                 .hint = hint});
  if (controller->has_own_stage && !model.starts_with(stage))
    return fail({.code = Errc::device_identity,
                 .what = "stage differs from the rig file",
                 .expected = stage,
                 .got = model,
                 .hint = hint});
  if (Status known = check_scale(*settings.model, model); !known) return known;
  if (names_a_stage(info.stage_id) && info.stage_id != settings.model->stage_id)
    return fail({.code = Errc::device_settings,
                 .what = "controller configured for another stage",
                 .expected = "stage id " + std::to_string(settings.model->stage_id),
                 .got = "stage id " + std::to_string(info.stage_id),
                 .hint = hint});
  if (settings.serial != 0 && settings.serial != info.serial)
    return fail({.code = Errc::device_identity,
                 .where = "/serial",
                 .what = "serial number of the unit differs from the rig file",
                 .expected = std::to_string(settings.serial),
                 .got = std::to_string(info.serial),
                 .hint = "Check whether two stages were exchanged, or correct the rig file"});
  if (info.channels != 0 && settings.channel > info.channels)
    return fail({.code = Errc::device_settings,
                 .where = "/channel",
                 .what = "channel not available on the controller",
                 .expected = "1 to " + std::to_string(info.channels),
                 .got = std::to_string(settings.channel)});
  return {};
}

DeviceIdentity identity_of(const StageSettings& settings, const HardwareInfo& info) {
  const std::string unit = settings.model->axis == protocols::apt::Axis::linear ? "m" : "rad";
  DeviceIdentity identity;
  identity.reported = {{"model", info.model.str()},
                       {"serial", std::to_string(info.serial)},
                       {"firmware", std::to_string(info.firmware_major) + "." +
                                        std::to_string(info.firmware_interim) + "." +
                                        std::to_string(info.firmware_minor)},
                       {"hardware_version", std::to_string(info.hardware_version)},
                       {"stage_id", std::to_string(info.stage_id)},
                       {"notes", info.notes.str()}};
  identity.scale = {
      {"counts_per_" + unit, settings.scale.counts_per_unit},
      {"velocity_counts_per_" + unit + "_s", settings.scale.velocity_counts},
      {"acceleration_counts_per_" + unit + "_s2", settings.scale.acceleration_counts}};
  return identity;
}

}  // namespace weft::drivers
