#include <algorithm>
#include <catch2/catch.hpp>
#include <limits>

#include "sim/plant/plant.hpp"
#include "tests/unit/plant/modal_sounding_support.hpp"

namespace modal_sounding_runs_test {

using namespace weft;
using namespace weft::sim;
using namespace weft::sim::test;

namespace {

/// A press and a slide on a complete fabric, with every sensor.
struct Run {
  std::vector<double> values;
  ContactState state;
};

template <class Between>
Run press_and_slide(const Bench& bench, Between&& between) {
  SoundingContact sounding = bench.sounding(TimePoint(Duration(1'234'567)));
  const double z_m = bench.height_m(4);
  Run run{{}, hanging(bench.material, z_m - 2e-3)};
  for (int i = 1; i <= 900; ++i) {
    const Pose to{.x_m = 4e-6 * std::max(0, i - 500), .z_m = z_m + std::min(0.0, -2e-3 + 5e-6 * i)};
    run.state = sounding.advance(run.state, to, Duration(grid_ns));
    sounding = between(std::move(sounding), run.state);
    if (i % 7 != 0) continue;
    const VibrationReadings readings = sounding.take();
    for (const AccelerationReading& r : readings.acceleration)
      run.values.insert(run.values.end(), {static_cast<double>(r.index), r.acceleration_mps2[0],
                                           r.acceleration_mps2[1], r.acceleration_mps2[2]});
    for (const SoundReading& r : readings.sound)
      run.values.insert(run.values.end(), {static_cast<double>(r.index), r.pressure_pa});
  }
  return run;
}

bool same_state(const ContactState& a, const ContactState& b) {
  return a.normal_n == b.normal_n && a.extension_m == b.extension_m && a.lag_m == b.lag_m &&
         a.velocity_mps == b.velocity_mps && a.bristle == b.bristle && a.branch == b.branch &&
         a.relaxation.relaxed_n == b.relaxation.relaxed_n;
}

Bench whole_bench() {
  Bench bench;
  bench.material = whole("denim");
  bench.field = ribs(0.4e-3, 4e-6);
  bench.vibration = {};
  return bench;
}

}  // namespace

TEST_CASE("A run of level L3 that is split, or looked at in between, has the same bits") {
  const Bench bench = whole_bench();
  const auto run_further = [](SoundingContact s, const ContactState&) { return s; };
  const auto split = [](const SoundingContact& s, const ContactState& state) {
    static_cast<void>(s.peek(state, {.z_m = state.pose.z_m + 1e-5}, Duration(777'777)));
    return SoundingContact(s);  // saved and restored
  };
  const Run single = press_and_slide(bench, run_further), again = press_and_slide(bench, split);
  CHECK(single.values.size() > 20'000);
  CHECK(single.values == again.values);
  CHECK(same_state(single.state, again.state));
}

TEST_CASE("peek() of level L3 is what advance() leads to") {
  const Bench bench = whole_bench();
  SoundingContact sounding = bench.sounding();
  const double z_m = bench.height_m(4);
  ContactState state = hanging(bench.material, z_m - 0.2e-3);
  for (int i = 0; i < 100; ++i) {
    const Pose to{.x_m = 4e-6 * i, .z_m = z_m - 0.2e-3 + 5e-6 * i};
    const ContactState peeked = sounding.peek(state, to, Duration(2'000'001));
    state = sounding.advance(state, to, Duration(2'000'001));
    CHECK(same_state(peeked, state));
  }
  CHECK(state.normal_n > 0);
}

TEST_CASE("Readings lie on whole multiples of their periods since time zero, none is missing") {
  Bench bench = whole_bench();
  for (const std::int64_t start_ns :
       {std::int64_t{0}, std::int64_t{4'999'999}, std::int64_t{86'400'000'000'001}}) {
    SoundingContact sounding = bench.sounding(TimePoint(Duration(start_ns)));
    ContactState state = hanging(bench.material, bench.height_m(4) - 1e-3);
    const std::int64_t uneven[] = {1, 62'499, 62'500, 3'072'000, 999'999'937, 0, 5'000'000};
    std::vector<AccelerationReading> acceleration;
    std::vector<SoundReading> sound;
    std::int64_t now_ns = start_ns;
    for (const std::int64_t dt_ns : uneven) {
      state = sounding.advance(state, state.pose, Duration(dt_ns));
      now_ns += dt_ns;
      const VibrationReadings readings = sounding.take();
      acceleration.insert(acceleration.end(), readings.acceleration.begin(),
                          readings.acceleration.end());
      sound.insert(sound.end(), readings.sound.begin(), readings.sound.end());
      CHECK(sounding.now() == TimePoint(Duration(now_ns)));
      // All readings due at `now`, and no others.
      CHECK(static_cast<std::int64_t>(acceleration.size()) ==
            now_ns / 5'000'000 - start_ns / 5'000'000);
      CHECK(static_cast<std::int64_t>(sound.size()) == now_ns / 125'000 - start_ns / 125'000);
    }
    for (std::size_t i = 0; i < sound.size(); ++i)
      REQUIRE(sound[i].index == static_cast<std::uint64_t>(start_ns) / 125'000 + 1 + i);
    for (std::size_t i = 0; i < acceleration.size(); ++i)
      REQUIRE(acceleration[i].index == static_cast<std::uint64_t>(start_ns) / 5'000'000 + 1 + i);
  }
}

TEST_CASE(
    "Without a sensor level L3 is level L2 bit for bit; a sensor moves it by its steps only") {
  Bench bench = whole_bench();
  bench.dynamics.step_s = 384e-6;
  Bench silent = bench;
  silent.vibration.accelerometer.reset();
  silent.vibration.microphone.reset();
  SoundingContact silent_one = silent.sounding(), sounding_one = bench.sounding();
  const DynamicContact alone = bench.contact();
  const double z_m = bench.height_m(4);
  ContactState state = hanging(bench.material, z_m - 1e-3), quiet = state, received = state;
  double apart_n = 0;
  for (int i = 1; i <= 1000; ++i) {
    const Pose to{.y_m = 4e-6 * std::max(0, i - 600), .z_m = std::min(z_m, z_m - 1e-3 + 3e-6 * i)};
    state = alone.step(state, to, to_seconds(Duration(grid_ns)));
    quiet = silent_one.advance(quiet, to, Duration(grid_ns));
    received = sounding_one.advance(received, to, Duration(grid_ns));
    apart_n = std::max(apart_n, std::abs(received.normal_n - state.normal_n));
  }
  CHECK(same_state(state, quiet));
  const VibrationReadings none = silent_one.take();
  CHECK(none.acceleration.empty());
  CHECK(none.sound.empty());
  CHECK(state.normal_n > 1);
  CHECK(apart_n < 5e-3);
}

TEST_CASE("A sensor that is asked for does not change what the other one reads") {
  Bench both_sensors = whole_bench(), one = whole_bench();
  one.vibration.microphone.reset();
  const auto accelerations = [](const Bench& bench) {
    SoundingContact sounding = bench.sounding();
    const double z_m = bench.height_m(4);
    const ContactState state = hanging(bench.material, z_m - 1e-3);
    static_cast<void>(go(sounding, state, {.x_m = 1e-3, .z_m = z_m}, 0.4));
    return axis_of(sounding.take(), 2);
  };
  CHECK(accelerations(both_sensors) == accelerations(one));
}

TEST_CASE("Level L3 refuses what it cannot sample, and poses and times that cannot be") {
  const double not_a_number = std::numeric_limits<double>::quiet_NaN();
  Bench bench = whole_bench();
  const auto refused = [&](auto change, TimePoint start = {}) {
    VibrationParams params = bench.vibration;
    double skew_rad = 0;
    change(params, skew_rad);
    return !SoundingContact::make(bench.contact(), params, bench.field, skew_rad, 1, start);
  };
  CHECK_FALSE(refused([](VibrationParams&, double&) {}));
  CHECK(refused([](VibrationParams& p, double&) { p.step_ns = 0; }));
  CHECK(refused([](VibrationParams& p, double&) { p.step_ns = -62'500; }));
  CHECK(refused([](VibrationParams& p, double&) { p.step_ns = 999; }));
  CHECK(refused([](VibrationParams& p, double&) { p.accelerometer->converter.period_ns = 0; }));
  CHECK(refused([](VibrationParams& p, double&) { p.microphone->converter.period_ns = 62'499; }));
  CHECK(refused([](VibrationParams& p, double&) { p.microphone->converter.bandwidth_hz = 9000; }));
  CHECK(refused([&](VibrationParams&, double& skew) { skew = not_a_number; }));
  CHECK(refused([](VibrationParams&, double&) {}, TimePoint(Duration(-1))));

  SoundingContact sounding = bench.sounding();
  const double z_m = bench.height_m(4);
  ContactState state = go(sounding, hanging(bench.material, z_m - 1e-3), {.z_m = z_m}, 0.5);
  static_cast<void>(sounding.take());
  for (const Duration dt :
       {Duration(-1), Duration(1'000'000'001), Duration::max(), Duration::min()}) {
    CHECK(same_state(sounding.advance(state, {.z_m = z_m + 1e-4}, dt), state));
    CHECK(same_state(sounding.peek(state, {.z_m = z_m + 1e-4}, dt), state));
  }
  CHECK(sounding.take().sound.empty());
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {not_a_number, inf, -inf, 1e308}) {
    const ContactState after = sounding.advance(state, {.z_m = bad}, Duration(grid_ns));
    CHECK(same_state(after, state));  // the contact is unchanged, the sensors continue
    const VibrationReadings readings = sounding.take();
    CHECK(readings.sound.size() > 20);
    for (const SoundReading& r : readings.sound) CHECK(std::isfinite(r.pressure_pa));
  }
}

TEST_CASE("The plant delivers vibrations at level L3 and none below") {
  const Patch patch = patch_of(library(), "denim", 1);
  const double touch_m = plate_z - patch.material.thickness_m;
  const auto readings_of = [&](Level level, VibrationParams vibration) {
    PlantParams params;
    params.level = level;
    params.geometry = level_plate();
    params.vibration = vibration;
    REQUIRE(check(params, patch.material).has_value());
    Plant plant(params, 1);
    plant.mount(patch, {.z_m = touch_m - 1e-3}, TimePoint(std::chrono::seconds(3)));
    for (int i = 1; i <= 500; ++i)
      plant.advance({.z_m = touch_m - 1e-3 + 3e-6 * i}, to_seconds(Duration(grid_ns)));
    CHECK(plant.contact().normal_n > 0);
    return plant.extract_vibration();
  };
  CHECK(readings_of(Level::quasistatic, {}).sound.empty());
  CHECK(readings_of(Level::dynamic, {}).acceleration.empty());
  const VibrationReadings all = readings_of(Level::modal, {});
  CHECK(all.acceleration.size() == 307);  // 1.536 s at 200 Hz
  CHECK(all.acceleration.front().index == 601);
  CHECK(all.sound.size() == 12288);
  VibrationParams deaf;
  deaf.microphone.reset();
  const VibrationReadings acceleration = readings_of(Level::modal, deaf);
  CHECK(acceleration.sound.empty());
  CHECK(acceleration.acceleration.size() == 307);

  PlantParams params;
  params.level = Level::modal;
  params.vibration.microphone->converter.period_ns = 100'000;
  const Status refused = check(params, patch.material);
  REQUIRE_FALSE(refused.has_value());
  CHECK(to_string(refused.error()).find("microphone: period_ns") != std::string::npos);
}

}  // namespace modal_sounding_runs_test
