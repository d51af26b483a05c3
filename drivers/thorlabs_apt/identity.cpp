#include "drivers/thorlabs_apt/settings.hpp"

#include <array>
#include <string>

namespace weft::drivers {
namespace {

using protocols::apt::Family;
using protocols::apt::HardwareInfo;

struct Controller {
  std::string_view prefix;
  Family family;
  bool has_own_stage;  ///< the model names the stage: an LTS300 is not an LTS150
};

// Families by the status message that they send (device-facts.md, APT conversation, APT
// controllers).
constexpr std::array controllers{
    Controller{"LTS", Family::stepper, true},  Controller{"K10CR", Family::stepper, true},
    Controller{"BSC", Family::stepper, false}, Controller{"TST", Family::stepper, false},
    Controller{"SCC", Family::stepper, false}, Controller{"KST", Family::stepper, false},
    Controller{"KDC", Family::servo, false},   Controller{"TDC", Family::servo, false},
    Controller{"BBD", Family::servo, false},   Controller{"KBD", Family::servo, false},
};

const Controller* find_controller(std::string_view model) {
  for (const Controller& c : controllers)
    if (model.starts_with(c.prefix)) return &c;
  return nullptr;
}

/// The controllers with a known scale for a stage (device-facts.md, APT scales); it counts
/// otherwise on others: 25600 to the mm, not 409600, on a BSC10x or a TST001. Cards of a BSC20x say
/// SCC20x.
struct KnownScale {
  std::string_view stage, prefix, name;
};
constexpr std::array known_scales{
    KnownScale{"LTS150", "LTS150", "LTS150"},  KnownScale{"LTS150", "BSC20", "BSC20x"},
    KnownScale{"LTS150", "SCC20", "SCC20x"},   KnownScale{"NRT150", "BSC20", "BSC20x"},
    KnownScale{"NRT150", "SCC20", "SCC20x"},   KnownScale{"PRM1-Z8", "KDC101", "KDC101"},
    KnownScale{"PRM1-Z8", "TDC001", "TDC001"}, KnownScale{"CR1-Z7", "KDC101", "KDC101"},
    KnownScale{"CR1-Z7", "TDC001", "TDC001"},  KnownScale{"K10CR1", "K10CR1", "K10CR1"},
};

/// Errors: device, with the controllers that would do.
Status check_scale(std::string_view stage, const std::string& model) {
  std::string known;
  for (const KnownScale& scale : known_scales) {
    if (scale.stage != stage) continue;
    if (model.starts_with(scale.prefix)) return {};
    known += (known.empty() ? "" : ", ") + std::string(scale.name);
  }
  return fail({.code = Errc::device_identity,
               .what = "the scale of a " + std::string(stage) + " on this controller is not known",
               .expected = known,
               .got = model,
               .hint =
                   "Its counts may be other lengths than the driver's: a BSC10x or TST001 would go "
                   "sixteen times as far; take a controller of the list"});
}

// Stage ids of KDC101/TDC001 (device-facts.md, APT info reply): 1 is none, 12 a stage of another
// maker.
constexpr bool names_a_stage(std::uint16_t stage_id) {
  return stage_id >= 2 && stage_id <= 11;
}

}  // namespace

Status check_identity(const StageSettings& settings, const HardwareInfo& info) {
  const std::string model = info.model.str();
  const std::string stage(settings.model->name);
  const char* hint = "Check the rig file's port and stage";
  const Controller* controller = find_controller(model);
  if (controller == nullptr || controller->family != settings.family)
    return fail({.code = Errc::device_identity,
                 .what = "the controller is of another kind",
                 .expected = settings.family == Family::servo
                                 ? "a DC servo controller such as KDC101"
                                 : "a stepper controller such as LTS150",
                 .got = '"' + model + '"',
                 .hint = hint});
  if (controller->has_own_stage && !model.starts_with(stage))
    return fail({.code = Errc::device_identity,
                 .what = "the unit is another stage",
                 .expected = stage,
                 .got = model,
                 .hint = hint});
  if (Status known = check_scale(stage, model); !known) return known;
  if (names_a_stage(info.stage_id) && info.stage_id != settings.model->stage_id)
    return fail({.code = Errc::device_settings,
                 .what = "the controller is set up for another stage",
                 .expected = "stage id " + std::to_string(settings.model->stage_id),
                 .got = std::to_string(info.stage_id),
                 .hint = hint});
  if (settings.serial != 0 && settings.serial != info.serial)
    return fail({.code = Errc::device_identity,
                 .where = "/serial",
                 .what = "the unit has another serial number",
                 .expected = std::to_string(settings.serial),
                 .got = std::to_string(info.serial),
                 .hint = "Two stages may have changed places"});
  if (info.channels != 0 && settings.channel > info.channels)
    return fail({.code = Errc::device_settings,
                 .where = "/channel",
                 .what = "the controller does not have this channel",
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
