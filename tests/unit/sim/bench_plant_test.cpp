#include "sim/devices/bench_plant.hpp"

#include <algorithm>
#include <array>
#include <catch2/catch.hpp>

#include "sim/devices/taxel_emulator.hpp"
#include "sim/plant/random.hpp"
#include "tests/unit/plant/support.hpp"

namespace bench_plant_test {

using namespace weft;
using namespace weft::sim;

namespace {

BenchPlantParams plant_params() {
  BenchPlantParams params;
  for (StageParams& stage : params.stages)
    stage = {.low = -1, .high = 1, .start = 0.05, .quantum = 1e-6, .backlash = 0};
  params.stages[3].start = params.stages[4].start = 0;
  params.plant.geometry.plate_z_m = 0.06;
  return params;
}

/// A press and a slide, observed `extra` times more than needed; returns all counts and forces.
std::vector<double> press_and_slide(std::uint64_t seed, std::uint64_t patch, int extra,
                                    Level level = Level::quasistatic) {
  BenchPlantParams params = plant_params();
  params.plant.level = level;
  BenchPlant bench_plant(params, seed);
  Random random(extra);
  std::vector<double> seen;
  bench_plant.mount(test::patch_of(test::library(), "jersey", patch), {});
  for (int i = 0; i < 300; ++i) {
    const TimePoint t{Duration(i * 20'000'000LL)};
    for (int k = 0; k < extra; ++k)
      bench_plant.contact(t - Duration(static_cast<std::int64_t>(random.uniform(0, 2e7))));
    if (i == 5) bench_plant.stage(AxisId::z, t).move_to(0.0601, {4e-3, 0.02}, t);
    if (i == 205) bench_plant.stage(AxisId::y, t).move_to(0.07, {2e-3, 0.02}, t);
    seen.push_back(bench_plant.contact(t).normal_n);
    for (const auto count : bench_plant.frame(t).counts) seen.push_back(count);
  }
  return seen;
}

}  // namespace

TEST_CASE("what the world does not depend on is who looks at it, and when") {
  const auto once = press_and_slide(1, 1, 0);
  CHECK(once == press_and_slide(1, 1, 3));
  CHECK(once != press_and_slide(2, 1, 0));
  CHECK(once != press_and_slide(1, 2, 0));
  const auto dynamic = press_and_slide(1, 1, 0, Level::dynamic);
  CHECK(dynamic == press_and_slide(1, 1, 3, Level::dynamic));
  CHECK(dynamic != once);
}

TEST_CASE("pads are converted two at a time, 3.072 ms apart") {
  BenchPlant bench_plant(plant_params(), 1);
  bench_plant.mount(test::patch_of(test::library(), "felt", 1), {});
  bench_plant.stage(AxisId::z, {}).move_to(0.06, {4e-3, 0.02}, {});
  bench_plant.advance_to(TimePoint(std::chrono::seconds(8)));
  // A sudden stop of the press: pads converted before and after it measure the force at their own
  // time.
  const TimePoint start = BenchPlant::frame_start(400);
  bench_plant.advance_to(start);
  const auto before = bench_plant.plant().pad_pressures_pa();
  bench_plant.stage(AxisId::z, start)
      .move_to(0.0604, {1, 100}, start);  // a blow within milliseconds
  bench_plant.advance_to(start + Duration(3 * pad_timing::stage_ns));
  const auto after = bench_plant.plant().pad_pressures_pa();
  for (std::size_t pad = 0; pad < pad_count; ++pad) {
    const bool converted = pad % 8 < 3;
    CHECK((after[pad] != before[pad]) == converted);
  }
}

TEST_CASE("the sensor sends 37 whole frames a second, however they are cut") {
  for (const std::size_t chunk : {0U, 1U, 5U, 100U}) {
    BenchPlant bench_plant(plant_params(), 1);
    const TimePoint on{std::chrono::milliseconds(40)};
    TaxelEmulator sensor({chunk, 9}, bench_plant, on);
    protocols::taxel::Splitter splitter;
    std::size_t largest = 0;
    ByteSink sink = [&](ByteView bytes) {
      largest = std::max(largest, bytes.size());
      splitter.push(bytes);
    };
    for (TimePoint t = *sensor.next_wakeup(); t <= on + std::chrono::seconds(10);
         t = *sensor.next_wakeup())
      sensor.wake(t, sink);
    protocols::taxel::Frame frame;
    int frames = 0;
    std::uint32_t last_us = 0;
    while (splitter.next(frame)) {
      CHECK(frame.sequence == frames++);
      CHECK(frame.taxel_count == 16);
      CHECK(frame.counts[0] >= 3900);
      if (last_us != 0) CHECK(frame.device_us - last_us == Approx(27027).margin(1));
      last_us = frame.device_us;
    }
    CHECK(frames == Approx(369).margin(1));
    CHECK(splitter.skipped_bytes() == 0);
    CHECK(largest <= (chunk == 0 ? protocols::taxel::frame_size(16) : chunk));
  }
}

TEST_CASE("an array of another shape and rate sends frames of its own taxels, with noise") {
  BenchPlant bench_plant(plant_params(), 1);
  TaxelEmulatorParams params;
  params.places = taxel_grid(4, 8);
  params.period_ns = 10'000'000;
  TaxelEmulator sensor(params, bench_plant, {});
  protocols::taxel::Splitter splitter;
  ByteSink sink = [&](ByteView bytes) { splitter.push(bytes); };
  for (TimePoint t = *sensor.next_wakeup(); t <= TimePoint{std::chrono::seconds(2)};
       t = *sensor.next_wakeup())
    sensor.wake(t, sink);
  protocols::taxel::Frame frame;
  std::array<bool, 32> changes{};
  std::array<std::uint16_t, 32> last{};
  int frames = 0;
  while (splitter.next(frame)) {
    REQUIRE(frame.taxel_count == 32);
    for (std::size_t i = 0; i < last.size(); ++i) {
      changes[i] = changes[i] || (frames > 0 && frame.counts[i] != last[i]);
      last[i] = frame.counts[i];
      CHECK(frame.counts[i] > 3900);  // smallest baseline of a pad
    }
    ++frames;
  }
  CHECK(frames == 200);
  CHECK(std::ranges::all_of(changes, [](bool changed) { return changed; }));
}

TEST_CASE("taxels where the plant has its pads read them, a scan of the plant late at most") {
  PadFrame before, newest;
  for (std::size_t pad = 0; pad < pad_count; ++pad) {
    before.counts[pad] = 1000;
    newest.counts[pad] = static_cast<std::uint16_t>(1000 + 16 * pad);
  }
  newest.index = 1;
  PadResampler same(taxel_grid(4, 4), 0, 1), between({{0, 0}}, 0, 1);
  std::array<std::uint16_t, pad_count> counts{};
  std::array<std::uint16_t, 1> middle{};
  const auto both = [&](const PadFrame& scan, TimePoint at) {
    same.sample(scan, at, 0, counts);
    between.sample(scan, at, 0, middle);
  };
  both(before, BenchPlant::frame_start(1));
  CHECK(counts == before.counts);
  both(newest, BenchPlant::frame_start(2));  // the next one has just arrived
  CHECK(counts == before.counts);
  both(newest, BenchPlant::frame_start(3));
  CHECK(counts == newest.counts);
  CHECK(middle[0] == 1000 + 16 * 15 / 2);  // the mean of pads 5, 6, 9 and 10
  both(newest, BenchPlant::frame_start(2) + Duration(pad_timing::frame_ns / 2));
  CHECK(counts[8] == 1000 + 16 * 8 / 2);
}

}  // namespace bench_plant_test
