#pragma once
// A stage driver and an emulated controller, connected by the test.

#include <catch2/catch.hpp>
#include <string>

#include "drivers/thorlabs_apt/stage_driver.hpp"
#include "sim/devices/apt_stage_emulator.hpp"
#include "tests/unit/drivers/fakes.hpp"

namespace weft::testing {

struct StageWorld {
  explicit StageWorld(const sim::AptStageParams& params, const std::string& more_config = "")
      : bench_plant(plant_for(params), 1), emulator(params, bench_plant, {}) {
    auto made = drivers::thorlabs_apt_entry.create(
        R"({"stage": ")" + std::string(params.stage->name) + "\"" + more_config + "}", host);
    if (!made) FAIL(to_string(made.error()));
    driver = std::move(*made);
  }

  static sim::BenchPlantParams plant_for(const sim::AptStageParams& params) {
    const double si = sim::si_per_unit(*params.stage);
    sim::BenchPlantParams plant;
    for (sim::StageParams& stage : plant.stages)
      stage = {.low = 0, .high = 0.15, .start = 0.02, .quantum = 0, .backlash = 0};
    plant.stages[static_cast<std::size_t>(params.axis)] = {.low = params.stage->travel_low * si,
                                                           .high = params.stage->travel_high * si,
                                                           .start = 2 * si,
                                                           .quantum = 0,
                                                           .backlash = 0};
    plant.plant.geometry.plate_z_m = 0.1;
    return plant;
  }

  /// Bytes written by one side reach the other at once; in steps of 5 ms.
  void run(double seconds) {
    for (const TimePoint end = host.loop_.now() + from_seconds(seconds); host.loop_.now() < end;) {
      host.loop_.run_for(0.005);
      const TimePoint now = host.loop_.now();
      sim::ByteSink sink = [&](ByteView bytes) { host.link_.deliver(bytes, now); };
      emulator.receive(host.link_.take_written(), now, sink);
      emulator.wake(now, sink);
    }
  }
  /// Runs until `holds` is true; false after `limit_s`.
  template <class Holds>
  bool run_until(Holds holds, double limit_s) {
    for (double waited = 0; waited < limit_s && !holds(); waited += 0.05) run(0.05);
    return holds();
  }
  bool bring_up() {
    REQUIRE(driver->open());
    if (!run_until([&] { return driver->state() == DriverState::open; }, 2)) return false;
    REQUIRE(driver->arm());
    return run_until([&] { return driver->state() == DriverState::armed; }, 2);
  }
  bool done(std::uint32_t id, double limit_s) {
    return run_until([&] { return !host.samples.empty() && sample().move_id == id; }, limit_s);
  }
  const StageSample& sample() const { return std::get<StageSample>(host.samples.back().value); }
  Errc fault_code() const { return host.faults.at(0).code; }
  bool logged(std::string_view words) const {
    for (const std::string& line : host.logs)
      if (line.find(words) != std::string::npos) return true;
    return false;
  }

  FakeHost host;
  sim::BenchPlant bench_plant;
  sim::AptStageEmulator emulator;
  std::unique_ptr<Driver> driver;
};

}  // namespace weft::testing
