#include "sim/plant/modal/vibration.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>

#include "tests/unit/plant/modal_sounding_support.hpp"

namespace vibration_test {

using namespace weft;
using namespace weft::sim;
using namespace weft::sim::test;

namespace {

const double not_a_number = std::numeric_limits<double>::quiet_NaN();
const double inf = std::numeric_limits<double>::infinity();

Vibration made(const VibrationParams& params, const HeightField& field = {},
               std::uint64_t seed = 1) {
  auto vibration = Vibration::make(params, field, seed);
  REQUIRE(vibration.has_value());
  return std::move(*vibration);
}

SlidingContact sliding(double x_m, double normal_n = 5, double friction_n = 1) {
  return {{x_m, 0}, {friction_n, 0}, normal_n, 1e5};
}

/// Amplitude of one frequency in evenly spaced values over whole periods.
double amplitude_over_periods(const std::vector<double>& values, double turns_per_value) {
  std::complex<double> sum = 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    sum += values[i] * std::polar(1.0, -two_pi * turns_per_value * static_cast<double>(i));
  return 2 * std::abs(sum) / static_cast<double>(values.size());
}

/// z acceleration during a slide at one speed, after the vibration of the contact has decayed.
std::vector<double> slide(Vibration& vibration, double speed_mps, int settle, int count) {
  std::vector<double> z;
  for (int i = 0; i < settle + count; ++i) {
    const auto sample = vibration.advance(sliding(speed_mps * i * 62.5e-6));
    if (i >= settle) z.push_back((*sample.acceleration_mps2)[2]);
  }
  return z;
}

}  // namespace

TEST_CASE("A rib of pitch P passed at speed v sounds at v/P, as loud as beam and face allow") {
  VibrationParams params = bare();
  params.microphone.reset();
  const double pitch = 1.25e-3, height = 4e-6, speed = 50e-3;  // 40 Hz: 400 steps of 62.5 us
  Vibration vibration = made(params, ribs(pitch, height));
  const std::vector<double> z = slide(vibration, speed, 48000, 16000);
  const double received = amplitude_over_periods(z, speed / pitch * 62.5e-6);

  const double k = two_pi / pitch * params.rubbing.face_half_width_m;
  const double force = 1e5 * height * std::abs(std::sin(k) / k);  // mean over the face
  const double w = two_pi * speed / pitch;
  const ArmParams& arm = params.accelerometer->arm;
  std::complex<double> gain = 0;
  const auto add_beam = [&](double fundamental_hz, double share) {
    for (const double overtone : {1.0, 6.26689, 17.54748, 34.38606}) {
      const double natural = two_pi * fundamental_hz * overtone;
      if (natural > two_pi * 7200) break;
      gain += share * -w * w * 4 / arm.mass_kg /
              std::complex<double>(natural * natural - w * w, 2 * arm.damping_ratio * natural * w);
    }
  };
  add_beam(arm.fundamental_hz[2], 1);
  add_beam(arm.fundamental_hz[0], 0.2 * arm.cross_axis);  // friction follows the load: mu = 0.2
  CHECK(received == Approx(force * std::abs(gain)).epsilon(5e-3));
  CHECK(amplitude_over_periods(z, 1.25 * speed / pitch * 62.5e-6) < 0.01 * received);
}

TEST_CASE("Twice the speed is twice the frequency; at rest nothing sounds") {
  VibrationParams params = bare();
  params.rubbing.asperity_share = 1e-4;
  const double pitch = 1.25e-3;  // at 1 mm the face would hold eight whole waves with a mean of
                                 // zero
  Vibration slow = made(params, ribs(pitch, 4e-6)), fast = made(params, ribs(pitch, 4e-6));
  const std::vector<double> at_slow = slide(slow, 25e-3, 48000, 16000);
  const std::vector<double> at_fast = slide(fast, 50e-3, 48000, 16000);
  CHECK(amplitude_over_periods(at_slow, 20 * 62.5e-6) >
        5 * amplitude_over_periods(at_slow, 40 * 62.5e-6));
  CHECK(amplitude_over_periods(at_fast, 40 * 62.5e-6) >
        5 * amplitude_over_periods(at_fast, 20 * 62.5e-6));
  Vibration still = made(params, ribs(pitch, 4e-6));
  CHECK(rms(slide(still, 0, 80000, 4000)) < 1e-7 * rms(at_slow));
}

TEST_CASE("Asperities hiss louder and higher the faster they pass, and follow the path alone") {
  Asperities noise(200e-6, 0.5, 7), again(200e-6, 0.5, 7), other(200e-6, 0.5, 8);
  double squares = 0, step_squares = 0, difference = 0, last = 0;
  constexpr int n = 200'000;
  for (int i = 0; i < n; ++i) {
    const double value = noise.at(2e-6 * i);
    squares += value * value;
    step_squares += i > 0 ? (value - last) * (value - last) : 0;
    last = value;
    if (i % 100 == 0) CHECK(value == again.at(2e-6 * i));
    difference += std::abs(value - other.at(2e-6 * i));
  }
  CHECK(std::sqrt(squares / n) == Approx(1).epsilon(0.03));
  CHECK(difference / n > 0.5);
  CHECK(std::sqrt(step_squares / n) < 0.5);  // smooth if the path is finely sampled

  VibrationParams params = bare();
  params.rubbing.asperity_share = 2e-3;
  Vibration slow = made(params), fast = made(params);
  CHECK(rms(slide(fast, 20e-3, 16000, 16000)) > 3 * rms(slide(slow, 2e-3, 16000, 16000)));
}

TEST_CASE("A blow makes the plate sound at its own frequencies") {
  const PlateParams plate;
  VibrationParams params = bare();
  params.accelerometer.reset();
  Vibration vibration = made(params);
  std::vector<double> sound;
  for (int i = 0; i < 32000; ++i) {
    const auto sample = vibration.advance(sliding(0, i < 2 ? 10 : 0, 0));
    REQUIRE(sample.sound_pa.has_value());
    REQUIRE_FALSE(sample.acceleration_mps2.has_value());
    if (i >= 100) sound.push_back(*sample.sound_pa);
  }
  const double first = plate_frequency_hz(plate, 1, 1) * 62.5e-6;
  CHECK(amplitude_over_periods(sound, first) > 10 * amplitude_over_periods(sound, 1.5 * first));
  CHECK(amplitude_over_periods(sound, first) > 10 * amplitude_over_periods(sound, 0.5 * first));
}

TEST_CASE(
    "A plate's frequencies are the textbook's and even modes, which move no air, are left out") {
  const PlateParams square{.length_m = 0.2, .width_m = 0.2, .thickness_m = 1e-3};
  // Simply supported square steel or aluminium plate: f11 = 19.74/(2 pi a^2) sqrt(D/(rho h)).
  const double d = 70e9 * 1e-9 / (12 * (1 - 0.33 * 0.33));
  CHECK(plate_frequency_hz(square, 1, 1) ==
        Approx(2 * std::pow(std::numbers::pi, 2) / (two_pi * 0.04) * std::sqrt(d / 2.7))
            .epsilon(1e-12));
  CHECK(plate_frequency_hz(square, 2, 1) ==
        Approx(2.5 * plate_frequency_hz(square, 1, 1)).epsilon(1e-12));
  const auto modes = plate_modes(square, 16000);
  REQUIRE(modes.has_value());
  for (const Mode& mode : *modes) {
    const double squares = 2 * mode.frequency_hz / plate_frequency_hz(square, 1, 1);
    CHECK(std::abs(std::remainder(squares - 2, 8)) < 1e-9);  // m^2 + n^2 of odd numbers
  }
  const auto arm = arm_modes({}, 1000);
  REQUIRE(arm.has_value());
  for (const Mode& mode : *arm) CHECK(mode.frequency_hz < 450);
  CHECK(arm->size() == 3);
  CHECK(arm_modes({}, 16000)->size() == 11);
}

TEST_CASE("Converters deliver at their own rates, in steps, within their range") {
  VibrationParams params;
  params.rubbing.asperity_share = 0.2;
  Vibration vibration = made(params, ribs(1e-3, 20e-6));
  int accelerations = 0, sounds = 0;
  double largest = 0;
  for (int i = 0; i < 16000; ++i) {
    const auto sample = vibration.advance(sliding(50e-3 * i * 62.5e-6));
    if (sample.acceleration_mps2) {
      ++accelerations;
      for (const double a : *sample.acceleration_mps2) {
        const double steps = a / (19.6133 / 2048);
        REQUIRE(steps == Approx(std::round(steps)).margin(1e-9));
        REQUIRE(std::abs(a) <= 19.6133);
      }
    }
    if (sample.sound_pa) {
      ++sounds;
      largest = std::max(largest, std::abs(*sample.sound_pa));
      REQUIRE(std::abs(*sample.sound_pa) <= 2);
    }
  }
  CHECK(accelerations == 200);
  CHECK(sounds == 8000);
  CHECK(largest > 1e-3);
}

TEST_CASE("At rest an accelerometer reads gravity and its own noise") {
  VibrationParams params;
  params.microphone.reset();
  Vibration vibration = made(params);
  std::vector<double> x, z;
  while (z.size() < 4000)
    if (const auto a = vibration.advance({}).acceleration_mps2) {
      x.push_back((*a)[0]);
      z.push_back((*a)[2] - 9.80665);
    }
  const double quantum = 19.6133 / 2048;
  const double expected = std::sqrt(0.02 * 0.02 + quantum * quantum / 12);
  CHECK(rms(x) == Approx(expected).epsilon(0.05));
  CHECK(rms(z) == Approx(expected).epsilon(0.05));
}

TEST_CASE("The low-pass lets the band through, stops what would fold back and keeps a level") {
  for (const auto& [frequency, gain] :
       {std::pair{1.0, 1.0}, {80.0, std::numbers::sqrt2 / 2}, {800.0, 1e-4}}) {
    auto filter = LowPass::make(80, 1.0 / 16000);
    REQUIRE(filter.has_value());
    std::vector<double> out;
    for (int i = 0; i < 64000; ++i) {
      const double value = filter->advance(std::sin(two_pi * frequency * i / 16000));
      if (i >= 32000) out.push_back(value);
    }
    CHECK(amplitude_over_periods(out, frequency / 16000) == Approx(gain).epsilon(0.02));
  }
  auto filter = LowPass::make(80, 1.0 / 16000);
  double value = 0;
  for (int i = 0; i < 16000; ++i) value = filter->advance(3);
  CHECK(value == Approx(3).epsilon(1e-9));
}

TEST_CASE("The same seed sounds the same; another seed does not") {
  const auto record = [](std::uint64_t seed) {
    Vibration vibration = made({}, ribs(1e-3, 4e-6), seed);
    std::vector<double> all;
    for (int i = 0; i < 4000; ++i) {
      const auto sample = vibration.advance(sliding(4e-3 * i * 62.5e-6));
      if (sample.sound_pa) all.push_back(*sample.sound_pa);
      if (sample.acceleration_mps2) all.push_back((*sample.acceleration_mps2)[0]);
    }
    return all;
  };
  CHECK(record(5) == record(5));
  CHECK(record(5) != record(6));
}

TEST_CASE("A run that is split goes on bit for bit") {
  const auto go = [](Vibration& vibration, int from, int to) {
    std::vector<double> all;
    for (int i = from; i < to; ++i) {
      const auto sample = vibration.advance(sliding(20e-3 * i * 62.5e-6));
      if (sample.sound_pa) all.push_back(*sample.sound_pa);
      if (sample.acceleration_mps2) all.push_back((*sample.acceleration_mps2)[2]);
    }
    return all;
  };
  Vibration whole = made({}, ribs(1.25e-3, 4e-6));
  go(whole, 0, 777);
  Vibration copy = whole;
  CHECK(go(whole, 777, 5000) == go(copy, 777, 5000));
}

TEST_CASE("A jump of the place is not a path that scratches") {
  auto rubbing = Rubbing::make({}, {}, 1);
  REQUIRE(rubbing.has_value());
  rubbing->advance(sliding(0));
  rubbing->advance(sliding(3e-3));
  rubbing->advance(sliding(900));
  rubbing->advance(sliding(900.002));
  CHECK(rubbing->path_m() == Approx(5e-3).epsilon(1e-9));
}

TEST_CASE("Waves and asperities take the load off but never pull, however rough") {
  RubbingParams params;
  params.asperity_share = 5;
  auto rubbing = Rubbing::make(params, ribs(1e-3, 100e-6), 7);
  REQUIRE(rubbing.has_value());
  std::size_t lifted = 0;
  for (int i = 0; i < 5000; ++i) {
    const Force force = rubbing->advance(sliding(i * 1e-6));
    REQUIRE(force[2] >= 0);
    if (force[2] > 0) continue;
    ++lifted;
    CHECK(force[0] == 0);  // without load there is no friction
  }
  CHECK(lifted > 100);
}

TEST_CASE("Asperities have their size from the first cell on") {
  std::vector<double> first;
  for (std::uint64_t seed = 0; seed < 400; ++seed)
    first.push_back(Asperities(200e-6, 0.5, seed).at(0));
  CHECK(rms(first) > 0.8);  // 1 on average along a path, sqrt(3/2) at the drawn values
  CHECK(rms(first) < 1.6);
}

TEST_CASE("Sensors that the scene does not have are not computed") {
  VibrationParams params;
  params.accelerometer.reset();
  params.microphone.reset();
  Vibration vibration = made(params, ribs(1e-3, 4e-6));
  const auto sample = vibration.advance(sliding(1e-3));
  CHECK_FALSE(sample.acceleration_mps2.has_value());
  CHECK_FALSE(sample.sound_pa.has_value());
}

TEST_CASE("No contact makes a reading that is not a number or leaves the range") {
  Vibration vibration = made({}, ribs(1e-3, 4e-6));
  Random random(1);
  for (int i = 0; i < 20000; ++i) {
    const double values[] = {not_a_number, inf, -inf, 1e308, -1e308, 5e-324, 0, 5};
    const auto any = [&] { return values[random.bits() % 8]; };
    const auto sample = vibration.advance({{any(), any()}, {any(), any()}, any(), any()});
    if (sample.sound_pa) REQUIRE(std::abs(*sample.sound_pa) <= 2);
    if (sample.acceleration_mps2)
      for (const double a : *sample.acceleration_mps2) REQUIRE(std::abs(a) <= 19.6134);
  }
}

TEST_CASE("Vibrations that cannot be are refused, whichever field is wrong") {
  for (const double bad : {not_a_number, inf, -inf, -1.0, 1e308}) {
    const auto refused = [&](auto field) {
      VibrationParams params;
      field(params) = bad;
      return !Vibration::make(params, {}, 1).has_value();
    };
    using P = VibrationParams&;
    CHECK(refused([](P p) -> double& { return p.accelerometer->converter.bandwidth_hz; }));
    CHECK(refused([](P p) -> double& { return p.accelerometer->converter.noise; }));
    CHECK(refused([](P p) -> double& { return p.accelerometer->converter.range; }));
    CHECK(refused([](P p) -> double& { return p.microphone->converter.quantum; }));
    CHECK(refused([](P p) -> double& { return p.accelerometer->arm.mass_kg; }));
    CHECK(refused([](P p) -> double& { return p.accelerometer->arm.fundamental_hz[1]; }));
    CHECK(refused([](P p) -> double& { return p.accelerometer->arm.damping_ratio; }));
    CHECK(refused([](P p) -> double& { return p.accelerometer->arm.cross_axis; }));
    CHECK(refused([](P p) -> double& { return p.microphone->plate.length_m; }));
    CHECK(refused([](P p) -> double& { return p.microphone->plate.width_m; }));
    CHECK(refused([](P p) -> double& { return p.microphone->plate.thickness_m; }));
    CHECK(refused([](P p) -> double& { return p.microphone->plate.modulus_pa; }));
    CHECK(refused([](P p) -> double& { return p.microphone->plate.density_kg_m3; }));
    CHECK(refused([](P p) -> double& { return p.microphone->plate.poisson_ratio; }));
    CHECK(refused([](P p) -> double& { return p.microphone->plate.contact_x; }));
    CHECK(refused([](P p) -> double& { return p.microphone->plate.microphone_m; }));
    CHECK(refused([](P p) -> double& { return p.rubbing.face_half_width_m; }));
    CHECK(refused([](P p) -> double& { return p.rubbing.asperity_share; }));
    CHECK(refused([](P p) -> double& { return p.rubbing.coarsest_m; }));
    CHECK(refused([](P p) -> double& { return p.rubbing.finest_share; }));
    if (bad != -1.0)
      CHECK(refused([](P p) -> double& { return p.accelerometer->gravity_mps2[2]; }));
  }
  VibrationParams params;
  params.microphone->converter.period_ns = 100'000;
  const auto odd = Vibration::make(params, {}, 1);
  REQUIRE_FALSE(odd.has_value());
  CHECK(odd.error().code == Errc::range);
  CHECK(odd.error().where == "microphone: period_ns");
  CHECK(odd.error().expected.find("62500") != std::string::npos);
  CHECK(odd.error().got == "100000.000000");
  params = {};
  params.step_ns = 0;
  CHECK_FALSE(Vibration::make(params, {}, 1).has_value());
}

}  // namespace vibration_test
