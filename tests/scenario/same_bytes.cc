// Prints one digest per part of the simulation, over every bit that the plant computes at each
// level. script/same-bytes builds it with several compilers and compares the lines.

#include <cmath>
#include <cstdio>
#include <fstream>
#include <optional>
#include <sstream>

#include "sim/plant/dynamic/dynamic_contact.hpp"
#include "sim/plant/fabric.hpp"
#include "sim/plant/imprint/half_space.hpp"
#include "sim/plant/imprint/height_map.hpp"
#include "sim/plant/imprint/objects.hpp"
#include "sim/plant/modal/converter.hpp"
#include "sim/plant/plant.hpp"
#include "sim/plant/stage.hpp"
#include "tests/scenario/bytes_digest.hpp"

using namespace weft;
using testing::Digest;
using testing::expected;
using namespace weft::sim;

namespace {

void add(Digest& digest, const ContactState& contact) {
  digest.add(contact.normal_n);
  digest.add(contact.indentation_m);
  digest.add(contact.extension_m);
  for (const double force : contact.friction_n) digest.add(force);
  for (const double velocity : contact.velocity_mps) digest.add(velocity);
}

/// Lowers the probe onto the fabric, presses, drags it along both axes and lifts it; the plant
/// steps and the pads convert.
void plant_run(const char* what, const PlantParams& params, const FabricLibrary& table) {
  Digest digest;
  for (const char* name : {"corduroy", "silk", "terry"}) {
    const Patch patch =
        expected(cut_patch(*table.find(name), table.params, table.spread, MaterialSwitches{}, 3));
    Plant plant(params, 5);
    const double touch_m = params.geometry.plate_z_m - patch.material.thickness_m;
    const MotionLimits limits{4e-3, 20e-3};
    Stage z({.low = 0, .high = 0.15, .start = touch_m - 0.5e-3}), y({.low = 0, .high = 0.15});
    plant.mount(patch, {.z_m = z.carriage({})});
    z.move_to(touch_m + 1.1e-3, {1e-3, 20e-3}, {});
    for (int i = 1; i <= 1500; ++i) {
      const TimePoint now{Duration(pad_timing::stage_ns * i)};
      if (i == 600) y.move_to(5e-3, limits, now);
      if (i == 1300) z.move_to(touch_m - 1e-3, limits, now);
      const double y_m = y.carriage(now);
      plant.advance({.x_m = 0.3 * y_m, .y_m = y_m, .z_m = z.carriage(now), .rx_rad = 1e-3},
                    1e-9 * static_cast<double>(pad_timing::stage_ns));
      y.settle(now);
      z.settle(now);
      plant.convert(i % pad_timing::stages, static_cast<std::uint64_t>(i / pad_timing::stages));
      add(digest, plant.contact());
      for (const double pressure : plant.pad_pressures_pa()) digest.add(pressure);
      for (const std::uint16_t counts : plant.pad_counts()) digest.add(std::uint64_t{counts});
      const VibrationReadings received = plant.extract_vibration();
      for (const AccelerationReading& reading : received.acceleration)
        for (const double axis : reading.acceleration_mps2) digest.add(axis);
      for (const SoundReading& reading : received.sound) digest.add(reading.pressure_pa);
    }
  }
  digest.print(what);
}

/// A sensor and a fabric table with all effects that are off without a calibration.
PadParams busy_pads() {
  PadParams pads;
  pads.noise_per_count = 0.02;
  pads.noise_per_square = 1e-5;
  pads.common_mode = 0.01;
  pads.temperature_k = 2;
  pads.height_spread_m = 5e-6;
  return pads;
}

FabricLibrary worn_and_covered(FabricLibrary table) {
  table.params.cover = {60e-6, 300};
  table.params.wear = {0.5, 2e4};
  table.spread.mounting.tilt = 1e-3;
  table.spread.mounting.pad_height_m = 2e-6;
  return table;
}

/// Eight trials of one piece, mounted again after four: each begins in the state that the last one
/// left.
void touch_run(const char* what, PlantParams params, const FabricLibrary& table) {
  Digest digest;
  params.pads = busy_pads();
  Plant plant(params, 5);
  std::optional<PlantMemory> memory;
  std::uint64_t frame = 0;
  for (std::uint64_t touch = 0; touch < 8; ++touch) {
    const std::uint64_t mounting = touch / 4;
    if (touch % 4 == 0) memory.reset();
    const Patch patch = expected(cut_patch(*table.find("denim"), table.params, table.spread,
                                           MaterialSwitches{}, PatchSeeds{1, mounting, touch}));
    const double z_m = params.geometry.plate_z_m - patch.material.thickness_m + 0.3e-3;
    plant.mount(patch, {.z_m = z_m - 3e-3}, {}, memory ? &*memory : nullptr);
    for (int i = 0; i <= 40; ++i, ++frame) {
      plant.advance({.y_m = 1e-4 * i, .z_m = i < 40 ? z_m : z_m - 3e-3},
                    1e-9 * static_cast<double>(pad_timing::frame_ns));
      for (int stage = 0; stage < pad_timing::stages; ++stage) plant.convert(stage, frame);
      for (const std::uint16_t counts : plant.pad_counts()) digest.add(std::uint64_t{counts});
    }
    memory = plant.memory();
    add(digest, memory->contact);
    digest.add(memory->dose_pa_m);
    digest.add(memory->pads.common);
    digest.add(memory->pads.temperature_k);
    for (const double creep_pa : memory->pads.creep_pa) digest.add(creep_pa);
  }
  digest.print(what);
}

PlantParams at_level(Level level, Integrator integrator = Integrator::midpoint) {
  PlantParams params;
  params.level = level;
  params.dynamics.integrator = integrator;
  params.geometry.plate_z_m = 0.06;
  return params;
}

void imprints() {
  Digest winkler, half_space;
  for (const ObjectSpec& object : ellis_objects()) {
    const HeightMap map = expected(place(object, 32, 32, taxel_spacing_m, 4));
    const Imprint springs = expected(press_winkler(map, bed_under(object), heavy_press_n));
    winkler.add(springs.indentation_m);
    for (const double pressure : springs.pressure_pa) winkler.add(pressure);
    HalfSpace space =
        expected(HalfSpace::make(32, 32, taxel_spacing_m, {.modulus_pa = modulus_under(object)}));
    const Imprint pressed = expected(space.press(map, light_press_n));
    half_space.add(pressed.indentation_m);
    for (const double pressure : pressed.pressure_pa) half_space.add(pressure);
  }
  winkler.print("Z");
  half_space.print("Z+");
}

void oscillators() {
  Digest digest;
  for (const double ratio : {0.0, 0.05, 1.0, 7.0})
    for (const double h_s : {1e-6, 1e-3, 0.05}) {
      const Oscillator o{0.2, 2 * ratio * std::sqrt(1e4 * 0.2), 1e4};
      const OscillatorStep step = expected(OscillatorStep::make(o, h_s));
      OscillatorState state;
      for (int i = 0; i < 1000; ++i) state = step.advance(state, std::sin(i), std::sin(i + 1));
      digest.add(state.x_m);
      digest.add(state.v_mps);
    }
  digest.print("oscillator");
}

FabricLibrary library(const char* path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return expected(parse_fabrics(text.str()));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "same_bytes FABRICS.json\n");
    return 2;
  }
  const FabricLibrary table = library(argv[1]);
  plant_run("L0", at_level(Level::algebraic), table);
  plant_run("L1", at_level(Level::quasistatic), table);
  PlantParams seldom = at_level(Level::quasistatic);
  seldom.quasistatic_step_s = 1e-9 * static_cast<double>(pad_timing::frame_ns);
  plant_run("L1 per scan", seldom, table);
  plant_run("L2 midpoint", at_level(Level::dynamic), table);
  plant_run("L2 adaptive", at_level(Level::dynamic, Integrator::adaptive), table);
  plant_run("L2 TR-BDF2", at_level(Level::dynamic, Integrator::tr_bdf2), table);
  plant_run("L3", at_level(Level::modal), table);
  const FabricLibrary worn = worn_and_covered(table);
  touch_run("L0 touches", at_level(Level::algebraic), worn);
  touch_run("L1 touches", at_level(Level::quasistatic), worn);
  touch_run("L2 touches", at_level(Level::dynamic), worn);
  imprints();
  oscillators();
  return 0;
}
