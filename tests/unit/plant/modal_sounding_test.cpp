#include "sim/plant/modal/sounding_contact.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <numeric>

#include "sim/plant/plant.hpp"
#include "tests/unit/plant/dynamic_support.hpp"

using namespace weft;
using namespace weft::sim;
using namespace weft::sim::test;

namespace {

constexpr double two_pi = 2 * std::numbers::pi;
constexpr std::int64_t grid_ns = 3'072'000;  // a pad's conversion: no multiple of the ticks

/// Ribs across x: one wave of pitch P and amplitude a.
HeightField ribs(double pitch_m, double amplitude_m) {
  SurfaceSpec spec;
  spec.warp_pitch_m = spec.weft_pitch_m = pitch_m;
  spec.height_rms_m = amplitude_m / std::numbers::sqrt2;
  spec.structure.lines = {{1, 0, 1, 0}};
  return HeightField(spec, 3);
}

/// Every tick a reading, without noise, quantum, low-pass and gravity; no asperities.
VibrationParams bare() {
  VibrationParams params;
  const ConverterParams open{params.step_ns, 0, 0, 1e6, 0};
  params.accelerometer->converter = params.microphone->converter = open;
  params.accelerometer->gravity_mps2 = {};
  params.rubbing.asperity_share = 0;
  return params;
}

struct Bench {
  ContactMaterial material = plain("felt");
  DynamicsParams dynamics = with_step(62.5e-6);
  VibrationParams vibration = bare();
  HeightField field;
  double skew_rad = 0;

  [[nodiscard]] DynamicContact contact() const {
    return DynamicContact(level_plate(), {}, material, dynamics);
  }
  [[nodiscard]] SoundingContact sounding(TimePoint start = {}) const {
    auto made = SoundingContact::make(contact(), vibration, field, skew_rad, 1, start);
    REQUIRE(made.has_value());
    return std::move(*made);
  }
  /// Stage height at which this cloth rests under about `load_n` at level L1.
  [[nodiscard]] double height_m(double load_n) const {
    const Mount mount;
    const double depth_m =
        material.law.lambda_m *
        std::log1p(load_n / (level_plate().face_area_m2() * material.law.pressure_pa));
    return plate_z - material.thickness_m + depth_m +
           (load_n - mount.weight_n()) / mount.stiffness_n_m;
  }
};

/// Amplitude of one frequency in evenly spaced values, through a Hann window.
double amplitude_at(const std::vector<double>& values, double turns_per_value) {
  std::complex<double> sum = 0;
  double weights = 0;
  const double n = static_cast<double>(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    const double at = static_cast<double>(i);
    const double weight = 1 - std::cos(two_pi * (at + 0.5) / n);
    weights += weight;
    sum += weight * values[i] * std::polar(1.0, -two_pi * turns_per_value * at);
  }
  return 2 * std::abs(sum) / weights;
}

std::vector<double> axis_of(const VibrationReadings& readings, std::size_t axis) {
  std::vector<double> all;
  for (const auto& r : readings.acceleration) all.push_back(r.acceleration_mps2[axis]);
  return all;
}

double rms(const std::vector<double>& values) {
  return std::sqrt(std::inner_product(values.begin(), values.end(), values.begin(), 0.0) /
                   static_cast<double>(values.size()));
}

/// Goes to `to` in steps of the pads' grid at a constant speed.
ContactState go(SoundingContact& sounding, ContactState state, const Pose& to, double duration_s) {
  const Pose from = state.pose;
  const int steps = static_cast<int>(duration_s * 1e9 / static_cast<double>(grid_ns));
  for (int i = 1; i <= steps; ++i) {
    const double a = static_cast<double>(i) / steps;
    state = sounding.advance(state,
                             {.x_m = from.x_m + a * (to.x_m - from.x_m),
                              .y_m = from.y_m + a * (to.y_m - from.y_m),
                              .z_m = from.z_m + a * (to.z_m - from.z_m)},
                             Duration(grid_ns));
  }
  return state;
}

}  // namespace

TEST_CASE("A texture of pitch P passed at v gives its line at v/P in the accelerometer") {
  Bench bench;
  bench.material.friction.coefficient = 0;
  bench.vibration.microphone.reset();
  const double pitch_m = 1.25e-3, height_m = 2e-6;
  bench.field = ribs(pitch_m, height_m);
  const double z_m = bench.height_m(5);
  for (const double speed_mps : {25e-3, 50e-3}) {
    SoundingContact sounding = bench.sounding();
    ContactState state = hanging(bench.material, z_m - 1e-3);
    state = go(sounding, state, {.z_m = z_m}, 0.5);
    state = go(sounding, state, {.z_m = z_m}, 1.5);  // the touch rings out
    state = go(sounding, state, {.x_m = 0.5 * speed_mps, .z_m = z_m}, 0.5);
    CHECK(state.normal_n == Approx(5).epsilon(0.02));
    static_cast<void>(sounding.take());
    state = go(sounding, state, {.x_m = 2.5 * speed_mps, .z_m = z_m}, 2);
    const std::vector<double> z = axis_of(sounding.take(), 2);
    const double line = speed_mps / pitch_m * 62.5e-6;
    const double heard = amplitude_at(z, line);
    // Stiffness of the face times the ribs' mean under it, through the arm's first bending.
    const double stiffness =
        (state.normal_n + level_plate().face_area_m2() * bench.material.law.pressure_pa) /
        bench.material.law.lambda_m;
    const double k = two_pi / pitch_m * level_plate().face_half_width_m;
    const double force_n = stiffness * height_m * std::abs(std::sin(k) / k);
    const double w = two_pi * speed_mps / pitch_m;
    const ArmParams& arm = bench.vibration.accelerometer->arm;
    double gain = 0;
    for (const double overtone : {1.0, 6.26689, 17.54748, 34.38606})
      if (const double natural = two_pi * arm.fundamental_hz[2] * overtone; natural < two_pi * 7200)
        gain += 4 / arm.mass_kg * w * w / (natural * natural - w * w);
    CAPTURE(speed_mps);
    CHECK(heard == Approx(force_n * gain).epsilon(0.02));
    CHECK(amplitude_at(z, 1.3 * line) < 0.01 * heard);
    CHECK(amplitude_at(z, 0.7 * line) < 0.01 * heard);
  }
}

TEST_CASE("A touch rings at the arm's first mode and dies away as its damping says") {
  Bench bench;
  bench.vibration.microphone.reset();
  bench.material.friction.coefficient = 0;
  const double z_m = plate_z - bench.material.thickness_m - 0.2e-3;
  SoundingContact sounding = bench.sounding();
  // A blow: the probe falls from its stop for an instant and is lifted off again.
  ContactState state = hanging(bench.material, z_m);
  state = go(sounding, state, {.z_m = z_m + 1.2e-3}, 0.02);
  state = go(sounding, state, {.z_m = z_m - 1e-3}, 0.02);
  REQUIRE(state.normal_n == 0);
  state = go(sounding, state, {.z_m = z_m - 1e-3}, 0.05);  // overtones die first
  static_cast<void>(sounding.take());
  state = go(sounding, state, {.z_m = z_m - 1e-3}, 0.5);
  REQUIRE(state.normal_n == 0);
  const std::vector<double> z = axis_of(sounding.take(), 2);
  const ArmParams arm;
  const double natural_hz = arm.fundamental_hz[2], zeta = arm.damping_ratio;
  // Zero crossings give the frequency, successive crests the decay.
  std::vector<double> crossings_s, crests;
  double crest = 0;
  for (std::size_t i = 1; i < z.size(); ++i) {
    crest = std::max(crest, z[i]);
    if (!(z[i - 1] < 0 && z[i] >= 0)) continue;
    crossings_s.push_back(62.5e-6 * (static_cast<double>(i) - z[i] / (z[i] - z[i - 1])));
    if (crossings_s.size() > 1) crests.push_back(crest);
    crest = 0;
  }
  REQUIRE(crests.size() > 60);
  const double periods = static_cast<double>(crossings_s.size() - 1);
  const double damped_hz = natural_hz * std::sqrt(1 - zeta * zeta);
  CHECK(periods / (crossings_s.back() - crossings_s.front()) == Approx(damped_hz).epsilon(1e-3));
  const double per_period = std::exp(-two_pi * zeta / std::sqrt(1 - zeta * zeta));
  CHECK(std::pow(crests[60] / crests[10], 1.0 / 50) == Approx(per_period).epsilon(2e-3));
}

TEST_CASE("At rest on the cloth there is silence, off it too") {
  Bench bench;
  bench.vibration.rubbing.asperity_share = 2e-3;
  bench.field = ribs(1.25e-3, 4e-6);
  const double z_m = bench.height_m(5);
  SoundingContact sounding = bench.sounding();
  ContactState state = hanging(bench.material, z_m - 4e-3);
  state = go(sounding, state, {.z_m = z_m - 4e-3}, 0.1);
  const VibrationReadings off = sounding.take();
  CHECK(rms(axis_of(off, 2)) < 1e-12);
  state = go(sounding, state, {.z_m = z_m}, 0.5);
  const VibrationReadings touch = sounding.take();
  state = go(sounding, state, {.z_m = z_m}, 5);
  static_cast<void>(sounding.take());
  state = go(sounding, state, {.z_m = z_m}, 0.5);
  const VibrationReadings still = sounding.take();
  for (std::size_t axis = 0; axis < 3; ++axis)
    CHECK(rms(axis_of(still, axis)) < 1e-6 * rms(axis_of(touch, 2)));
  double loudest = 0;
  for (const SoundReading& r : still.sound) loudest = std::max(loudest, std::abs(r.pressure_pa));
  CHECK(loudest < 1e-6);
}

TEST_CASE("The stick-slip cycle is heard: lines at its multiples, and only there") {
  Bench bench;
  bench.vibration.microphone.reset();
  bench.material.friction = {.coefficient = 0.2, .exponent = 1, .bristle_length_m = 10e-6};
  bench.dynamics.static_ratio = 1.3;
  bench.dynamics.friction_speed_mps = 1;  // the coefficient is the kinetic one
  const auto heard = [&](double lateral_stiffness_n_m) {
    bench.dynamics.lateral_stiffness_n_m = lateral_stiffness_n_m;
    const double z_m = bench.height_m(5), speed_mps = 2e-3;  // F_C = 1 N, as in lugre_test.cpp
    SoundingContact sounding = bench.sounding();
    ContactState state = hanging(bench.material, z_m - 1e-3);
    state = go(sounding, state, {.z_m = z_m}, 0.5);
    state = go(sounding, state, {.y_m = 2 * speed_mps, .z_m = z_m}, 2);
    static_cast<void>(sounding.take());
    static_cast<void>(go(sounding, state, {.y_m = 6 * speed_mps, .z_m = z_m}, 4));
    return axis_of(sounding.take(), 1);
  };
  const std::vector<double> cycle = heard(1e4), smooth = heard(1e6);
  // On this guide the probe slips 24.3 times a second (lugre_test.cpp, Runge-Kutta), every other
  // time further: the cycle's own frequency is half of that.
  const auto comb = [&](double fundamental_hz, double shift) {
    double squares = 0;
    for (int n = 2; n <= 12; ++n) {
      const double a = amplitude_at(cycle, (n + shift) * fundamental_hz * 62.5e-6);
      squares += a * a;
    }
    return std::sqrt(squares);
  };
  double best_hz = 0, best = 0;
  for (double hz = 11; hz < 14; hz += 0.02)
    if (const double a = comb(hz, 0); a > best) best = a, best_hz = hz;
  CHECK(best_hz == Approx(24.3 / 2).margin(0.1));
  CHECK(best > 20 * comb(best_hz, 0.5));
  CHECK(rms(smooth) < 0.02 * rms(cycle));
}

namespace {

/// A press and a slide on a whole cloth, with every sensor.
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
  const auto go_on = [](SoundingContact s, const ContactState&) { return s; };
  const auto split = [](const SoundingContact& s, const ContactState& state) {
    static_cast<void>(s.peek(state, {.z_m = state.pose.z_m + 1e-5}, Duration(777'777)));
    return SoundingContact(s);  // saved and taken up again
  };
  const Run single = press_and_slide(bench, go_on), again = press_and_slide(bench, split);
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
      // Everything that is due at `now`, and nothing that is not.
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
  SoundingContact nobody = silent.sounding(), somebody = bench.sounding();
  const DynamicContact alone = bench.contact();
  const double z_m = bench.height_m(4);
  ContactState state = hanging(bench.material, z_m - 1e-3), quiet = state, heard = state;
  double apart_n = 0;
  for (int i = 1; i <= 1000; ++i) {
    const Pose to{.y_m = 4e-6 * std::max(0, i - 600), .z_m = std::min(z_m, z_m - 1e-3 + 3e-6 * i)};
    state = alone.step(state, to, to_seconds(Duration(grid_ns)));
    quiet = nobody.advance(quiet, to, Duration(grid_ns));
    heard = somebody.advance(heard, to, Duration(grid_ns));
    apart_n = std::max(apart_n, std::abs(heard.normal_n - state.normal_n));
  }
  CHECK(same_state(state, quiet));
  const VibrationReadings none = nobody.take();
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

TEST_CASE("Yarns that lie askew are heard at the pitch along the path") {
  Bench bench;
  bench.vibration.microphone.reset();
  bench.material.friction.coefficient = 0;
  const double pitch_m = 1.25e-3, speed_mps = 50e-3;
  bench.field = ribs(pitch_m, 4e-6);
  bench.skew_rad = two_pi / 6;  // 60 degrees: along x the pitch is twice as long
  const double z_m = bench.height_m(5);
  SoundingContact sounding = bench.sounding();
  ContactState state = hanging(bench.material, z_m - 1e-3);
  state = go(sounding, state, {.z_m = z_m}, 0.5);
  state = go(sounding, state, {.x_m = speed_mps, .z_m = z_m}, 1);
  static_cast<void>(sounding.take());
  static_cast<void>(go(sounding, state, {.x_m = 3 * speed_mps, .z_m = z_m}, 2));
  const std::vector<double> z = axis_of(sounding.take(), 2);
  const double line = speed_mps / pitch_m * 62.5e-6;
  CHECK(amplitude_at(z, line / 2) > 100 * amplitude_at(z, line));
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
    CHECK(same_state(after, state));  // the contact stands, the sensors go on listening
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
    return plant.take_vibration();
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
