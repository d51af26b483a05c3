// The only table of stages and of the controllers with a known scale for them. Driver, emulator,
// schema and `weft check` use it. docs/reference/rig.md is generated from the rows below, so each
// row is one line. Source "database" is Thorlabs' stage database MG17APTServer.ini (in THORPY);
// "memory" means that no source was found.

#include <algorithm>
#include <array>

#include "protocols/apt/stage_scale.hpp"

namespace weft::protocols::apt {
namespace {

constexpr Axis linear = Axis::linear, rotary = Axis::rotary;

// clang-format off
/// Name, axis, travel low and high, top speed and acceleration, default speed and acceleration,
/// homing speed and offset, backlash, homing direction and switch, forward and reverse limit
/// switch, stage id, usual controller, source. mm or degrees, and seconds.
constexpr std::array rows{
    StageModel{"LTS150", linear, 0, 150, 50, 50, 20, 20, 2, 0.5, 0.05, 2, 1, 2, 2, 0, "LTS150", "database, HS LTS150"},
    StageModel{"LTS300", linear, 0, 300, 50, 50, 20, 20, 2, 0.5, 0.05, 2, 1, 2, 2, 0, "LTS300", "database, HS LTS300"},
    StageModel{"NRT100", linear, 0, 100, 50, 50, 30, 30, 1, 0.1, 0.1, 2, 1, 2, 2, 0, "SCC201", "database, HS NRT100"},
    StageModel{"NRT150", linear, 0, 150, 50, 50, 30, 30, 1, 0.1, 0.1, 2, 1, 2, 2, 0, "SCC201", "database, HS NRT150"},
    StageModel{"MTS25-Z8", linear, 0, 25, 5, 5, 2.8, 1.5, 1, 1, 0.05, 2, 1, 2, 2, 7, "KDC101", "database"},
    StageModel{"MTS50-Z8", linear, 0, 50, 5, 5, 2.8, 1.5, 1, 1, 0.05, 2, 1, 2, 2, 8, "KDC101", "database"},
    StageModel{"Z806", linear, 0, 6, 5, 5, 2.5, 1.5, 1, 0.3, 0.025, 2, 1, 2, 2, 11, "KDC101", "database"},
    StageModel{"Z812", linear, 0, 12, 5, 5, 2.5, 1.5, 1, 0.3, 0.025, 2, 1, 2, 2, 10, "KDC101", "database"},
    StageModel{"Z825", linear, 0, 25, 5, 5, 2.2, 1.5, 1, 0.3, 0.025, 2, 1, 2, 2, 9, "KDC101", "database"},
    StageModel{"Z606", linear, 0, 6, 0.5, 0.5, 0.3, 0.4, 0.25, 1, 0.01, 2, 1, 2, 2, 0, "TDC001", "database"},
    StageModel{"Z612", linear, 0, 12, 0.5, 0.5, 0.3, 0.4, 0.25, 1, 0.01, 2, 1, 2, 2, 0, "TDC001", "database"},
    StageModel{"Z625", linear, 0, 25, 0.5, 0.5, 0.3, 0.4, 0.25, 1, 0.01, 2, 1, 2, 2, 0, "TDC001", "database"},
    StageModel{"DDSM100", linear, 0, 100, 250, 2000, 100, 500, 1, 1, 0.01, 2, 4, 3, 3, 0, "KBD101", "database"},
    StageModel{"DDS220", linear, 0, 220, 300, 5000, 100, 500, 10, 1, 0, 2, 4, 3, 3, 0, "KBD101", "memory"},
    StageModel{"DDS300", linear, 0, 300, 400, 5000, 100, 500, 10, 1, 0, 2, 4, 3, 3, 0, "KBD101", "memory"},
    StageModel{"DDS600", linear, 0, 600, 400, 5000, 100, 500, 10, 1, 0, 2, 4, 3, 3, 0, "KBD101", "memory"},
    StageModel{"MLS203", linear, 0, 110, 250, 2000, 100, 990, 1, 1, 0.01, 2, 4, 3, 3, 0, "BBD202", "database, MLS203 X"},
    StageModel{"PRM1-Z8", rotary, 0, 360, 25, 25, 10, 10, 10, 4, 1, 2, 1, 4, 1, 6, "KDC101", "database"},
    StageModel{"CR1-Z7", rotary, 0, 360, 6, 5, 4, 4, 2, 0.2, 0.2, 2, 1, 1, 1, 5, "TDC001", "database"},
    StageModel{"K10CR1", rotary, 0, 360, 10, 20, 10, 20, 10, 4, 1, 2, 1, 4, 1, 0, "K10CR1", "QMI; homing, backlash and switches: database, K100CR1"},
    StageModel{"HDR50", rotary, 0, 360, 50, 50, 10, 10, 5, 1, 0, 2, 1, 2, 2, 0, "SCC201", "memory"},
    StageModel{"NR360", rotary, 0, 360, 50, 80, 25, 25, 6, 0.6, 1, 2, 1, 3, 1, 0, "SCC201", "database, HS NanoRotator; top speed: memory"},
};

/// Stage, prefix of the controller's model, its display name, counts per mm or degree, per unit/s
/// and per unit/s2, source. The first pairing of a stage is its usual one.
constexpr std::array pairings{
    Pairing{"LTS150", "LTS150", "LTS150", {409600, 21987328, 4506}, "APT16"},
    Pairing{"LTS150", "BSC20", "BSC20x", {409600, 21987328, 4506}, "APT16"},
    Pairing{"LTS150", "SCC20", "SCC20x", {409600, 21987328, 4506}, "APT16"},
    Pairing{"LTS150", "BSC10", "BSC10x", {25600, 25600, 25600}, "APT16"},
    Pairing{"LTS150", "TST001", "TST001", {25600, 25600, 25600}, "APT16"},
    Pairing{"LTS300", "LTS300", "LTS300", {409600, 21987328, 4506}, "APT16"},
    Pairing{"LTS300", "BSC20", "BSC20x", {409600, 21987328, 4506}, "APT16"},
    Pairing{"LTS300", "SCC20", "SCC20x", {409600, 21987328, 4506}, "APT16"},
    Pairing{"NRT100", "BSC20", "BSC20x", {409600, 21987328, 4506}, "APT16"},
    Pairing{"NRT100", "SCC20", "SCC20x", {409600, 21987328, 4506}, "APT16"},
    Pairing{"NRT150", "BSC20", "BSC20x", {409600, 21987328, 4506}, "APT16"},
    Pairing{"NRT150", "SCC20", "SCC20x", {409600, 21987328, 4506}, "APT16"},
    Pairing{"NRT150", "BSC10", "BSC10x", {25600, 25600, 25600}, "APT16"},
    Pairing{"NRT150", "TST001", "TST001", {25600, 25600, 25600}, "APT16"},
    Pairing{"MTS25-Z8", "KDC101", "KDC101", {34304, 767367.49, 261.93}, "APT16, pyLabLib"},
    Pairing{"MTS25-Z8", "TDC001", "TDC001", {34304, 767367.49, 261.93}, "APT16, pyLabLib"},
    Pairing{"MTS50-Z8", "KDC101", "KDC101", {34304, 767367.49, 261.93}, "APT16, pyLabLib"},
    Pairing{"MTS50-Z8", "TDC001", "TDC001", {34304, 767367.49, 261.93}, "APT16, pyLabLib"},
    Pairing{"Z806", "KDC101", "KDC101", {34304, 767367.49, 261.93}, "APT16, pyLabLib"},
    Pairing{"Z806", "TDC001", "TDC001", {34304, 767367.49, 261.93}, "APT16, pyLabLib"},
    Pairing{"Z812", "KDC101", "KDC101", {34304, 767367.49, 261.93}, "APT16, pyLabLib"},
    Pairing{"Z812", "TDC001", "TDC001", {34304, 767367.49, 261.93}, "APT16, pyLabLib"},
    Pairing{"Z825", "KDC101", "KDC101", {34304, 767367.49, 261.93}, "APT16, pyLabLib"},
    Pairing{"Z825", "TDC001", "TDC001", {34304, 767367.49, 261.93}, "APT16, pyLabLib"},
    Pairing{"Z606", "TDC001", "TDC001", {24600, 550292.68, 187.83}, "APT16, pyLabLib"},
    Pairing{"Z606", "KDC101", "KDC101", {24600, 550292.68, 187.83}, "APT16, pyLabLib"},
    Pairing{"Z612", "TDC001", "TDC001", {24600, 550292.68, 187.83}, "APT16, pyLabLib"},
    Pairing{"Z612", "KDC101", "KDC101", {24600, 550292.68, 187.83}, "APT16, pyLabLib"},
    Pairing{"Z625", "TDC001", "TDC001", {24600, 550292.68, 187.83}, "APT16, pyLabLib"},
    Pairing{"Z625", "KDC101", "KDC101", {24600, 550292.68, 187.83}, "APT16, pyLabLib"},
    Pairing{"DDSM100", "KBD101", "KBD101", {2000, 13421.773, 1.3744}, "pyLabLib; T of APT16"},
    Pairing{"DDSM100", "BBD10", "BBD10x", {2000, 13421.773, 1.3744}, "pyLabLib; T of APT16"},
    Pairing{"DDSM100", "BBD20", "BBD20x", {2000, 13421.773, 1.3744}, "pyLabLib; T of APT16"},
    Pairing{"DDSM100", "BBD30", "BBD30x", {2000, 13421.773, 1.3744}, "pyLabLib; T of APT16"},
    Pairing{"DDS220", "KBD101", "KBD101", {20000, 134217.73, 13.744}, "APT16; on this controller pyLabLib, which asks for the stage alone"},
    Pairing{"DDS220", "BBD10", "BBD10x", {20000, 134217.73, 13.744}, "APT16"},
    Pairing{"DDS220", "BBD20", "BBD20x", {20000, 134217.73, 13.744}, "APT16"},
    Pairing{"DDS220", "BBD30", "BBD30x", {20000, 134217.73, 13.744}, "APT16; on this controller pyLabLib, which asks for the stage alone"},
    Pairing{"DDS300", "KBD101", "KBD101", {20000, 134217.73, 13.744}, "pyLabLib; T of APT16"},
    Pairing{"DDS300", "BBD10", "BBD10x", {20000, 134217.73, 13.744}, "pyLabLib; T of APT16"},
    Pairing{"DDS300", "BBD20", "BBD20x", {20000, 134217.73, 13.744}, "pyLabLib; T of APT16"},
    Pairing{"DDS300", "BBD30", "BBD30x", {20000, 134217.73, 13.744}, "pyLabLib; T of APT16"},
    Pairing{"DDS600", "KBD101", "KBD101", {20000, 134217.73, 13.744}, "pyLabLib; T of APT16"},
    Pairing{"DDS600", "BBD10", "BBD10x", {20000, 134217.73, 13.744}, "pyLabLib; T of APT16"},
    Pairing{"DDS600", "BBD20", "BBD20x", {20000, 134217.73, 13.744}, "pyLabLib; T of APT16"},
    Pairing{"DDS600", "BBD30", "BBD30x", {20000, 134217.73, 13.744}, "pyLabLib; T of APT16"},
    Pairing{"MLS203", "BBD20", "BBD20x", {20000, 134217.73, 13.744}, "APT16"},
    Pairing{"MLS203", "BBD10", "BBD10x", {20000, 134217.73, 13.744}, "APT16"},
    Pairing{"MLS203", "BBD30", "BBD30x", {20000, 134217.73, 13.744}, "APT16; on this controller pyLabLib, which asks for the stage alone"},
    Pairing{"MLS203", "KBD101", "KBD101", {20000, 134217.73, 13.744}, "APT16; on this controller pyLabLib, which asks for the stage alone"},
    Pairing{"PRM1-Z8", "KDC101", "KDC101", {1919.6418578623391, 42941.66, 14.66}, "APT16, pyLabLib"},
    Pairing{"PRM1-Z8", "TDC001", "TDC001", {1919.6418578623391, 42941.66, 14.66}, "APT16, pyLabLib"},
    Pairing{"CR1-Z7", "TDC001", "TDC001", {1638.4, 36650.4, 12.51}, "database: 48 counts x gear 256 / pitch 7.5; T of APT16"},
    Pairing{"CR1-Z7", "KDC101", "KDC101", {1638.4, 36650.4, 12.51}, "database: 48 counts x gear 256 / pitch 7.5; T of APT16"},
    Pairing{"K10CR1", "K10CR1", "K10CR1", {136533.33333333334, 7329109, 1502}, "QMI"},
    Pairing{"HDR50", "BSC20", "BSC20x", {75093.252797583924, 4031005.9301779053, 826.02478074342232}, "pyLabLib"},
    Pairing{"HDR50", "SCC20", "SCC20x", {75093.252797583924, 4031005.9301779053, 826.02478074342232}, "pyLabLib"},
    Pairing{"NR360", "BSC20", "BSC20x", {75093.252797583924, 4031005.9301779053, 826.02478074342232}, "APT16, pyLabLib"},
    Pairing{"NR360", "SCC20", "SCC20x", {75093.252797583924, 4031005.9301779053, 826.02478074342232}, "APT16, pyLabLib"},
};
// clang-format on

/// The family follows from the status message. The directions of MOVE_VELOCITY and MOVE_JOG are
/// those of clients tested on hardware (device-facts.md, APT messages). Serial numbers begin as in
/// device-facts.md, APT line.
constexpr std::array controllers{
    Controller{"LTS", Family::stepper, true, 1, 45000001},
    Controller{"K10CR", Family::stepper, true, 1, 55000001},
    Controller{"BSC", Family::stepper, false, 1, 40000001},
    Controller{"SCC", Family::stepper, false, 1, 40000001},
    Controller{"TST", Family::stepper, false, 1, 80000001},
    Controller{"KST", Family::stepper, false, 1, 26000001},
    Controller{"KDC", Family::servo, false, 2, 27000001},
    Controller{"TDC", Family::servo, false, 2, 83000001},
    Controller{"BBD", Family::servo, false, 1, 73000001},
    Controller{"KBD", Family::servo, false, 1, 28000001},
};

constexpr const Controller* controller_of(std::string_view model) {
  for (const Controller& controller : controllers)
    if (model.starts_with(controller.prefix)) return &controller;
  return nullptr;
}

constexpr StageModel model_of(const Pairing& pairing) {
  StageModel model = *std::find_if(
      rows.begin(), rows.end(), [&](const StageModel& row) { return row.name == pairing.stage; });
  model.scale = pairing.scale;
  model.family = controller_of(pairing.prefix)->family;
  return model;
}

/// paired_models: one model per pairing. models: each stage with its usual controller.
constexpr auto paired_models = [] {
  std::array<StageModel, pairings.size()> models{};
  std::transform(pairings.begin(), pairings.end(), models.begin(), model_of);
  return models;
}();
constexpr auto models = [] {
  std::array<StageModel, rows.size()> usual{};
  std::transform(rows.begin(), rows.end(), usual.begin(), [](const StageModel& row) {
    return model_of(*std::find_if(pairings.begin(), pairings.end(),
                                  [&](const Pairing& p) { return p.stage == row.name; }));
  });
  return usual;
}();

}  // namespace

std::span<const StageModel> stage_models() {
  return models;
}

std::span<const Pairing> stage_pairings() {
  return pairings;
}

std::span<const Controller> stage_controllers() {
  return controllers;
}

const StageModel* find_stage(std::string_view name) {
  for (const StageModel& model : models)
    if (model.name == name) return &model;
  return nullptr;
}

const StageModel* find_stage(std::string_view name, std::string_view controller) {
  for (std::size_t i = 0; i < pairings.size(); ++i)
    if (pairings[i].stage == name && controller.starts_with(pairings[i].prefix))
      return &paired_models[i];
  return nullptr;
}

const Controller* find_controller(std::string_view model) {
  return controller_of(model);
}

}  // namespace weft::protocols::apt
