#pragma once
// One APT stage on its own bench, for tests. Byte strings in the tests are those of
// protocols/apt/vectors; positions and times are those of the trapezoid.

#include <catch2/catch.hpp>
#include <utility>

#include "sim/devices/apt_stage_emulator.hpp"
#include "tests/unit/sim/support.hpp"

namespace weft::sim::test {

using protocols::apt::Axis;
using protocols::apt::DcStatusUpdate;
using protocols::apt::decode;
using protocols::apt::decode_body;
using protocols::apt::find_stage;
using protocols::apt::StatusUpdate;

inline BenchPlantParams stages_plant() {
  BenchPlantParams params;
  for (StageParams& stage : params.stages)
    stage = {.low = 0, .high = 0.15, .start = 0.02, .quantum = 0, .backlash = 0};
  params.stages[3] = {.low = -3.2, .high = 3.2, .start = 0.1, .quantum = 0, .backlash = 0};
  params.plant.geometry.plate_z_m = 0.1;
  return params;
}

/// One stage on its own bench.
struct Unit {
  explicit Unit(const std::string& stage = "LTS150",
                RetargetPolicy retarget = RetargetPolicy::replan)
      : Unit(params(stage, retarget)) {}
  explicit Unit(const AptStageParams& params)
      : bench_plant(stages_plant(), 1), emulator(params, bench_plant, {}) {}
  /// A stage with a controller of this model.
  static Unit at(const std::string& model, const std::string& stage) {
    AptStageParams p = params(stage, RetargetPolicy::replan);
    p.model = model;
    return Unit(p);
  }

  static AptStageParams params(const std::string& stage, RetargetPolicy retarget) {
    AptStageParams p;
    p.stage = find_stage(stage);
    p.axis = p.stage->axis == Axis::linear ? AxisId::x : AxisId::rx;
    p.model = p.stage->axis == Axis::linear ? "LTS150" : "KDC101";
    p.retarget = retarget;
    return p;
  }
  void send(const Bytes& bytes) { emulator.receive(bytes, now, sink); }
  void send(const std::string& text) { send(hex(text)); }
  /// Lets time pass, and calls the emulator at its requested times.
  void run(double seconds) {
    const TimePoint end = now + from_seconds(seconds);
    for (auto at = emulator.next_wakeup(); at && *at <= end; at = emulator.next_wakeup())
      emulator.wake(now = *at, sink);
    now = end;
  }
  Bytes take() { return std::exchange(out, {}); }
  StatusUpdate status() {
    take();
    send("80 04 01 00 50 01");
    return decode_body<StatusUpdate>(decode(take())->data).value();
  }
  void ready() {
    send("10 02 01 01 50 01");
    send("43 04 01 00 50 01");
    run(20);
    take();
  }
  double position() { return bench_plant.stage(AxisId::x).position(now); }

  Bytes out;
  ByteSink sink = [this](ByteView bytes) { out.insert(out.end(), bytes.begin(), bytes.end()); };
  TimePoint now{};
  BenchPlant bench_plant;
  AptStageEmulator emulator;
};

}  // namespace weft::sim::test
