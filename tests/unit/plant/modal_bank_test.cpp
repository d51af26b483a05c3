#include "sim/plant/modal/modal_bank.hpp"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/plant/modal/converter.hpp"
#include "sim/plant/random.hpp"

namespace modal_bank_test {

using namespace weft;
using namespace weft::sim;

namespace {

const double not_a_number = std::numeric_limits<double>::quiet_NaN();
const double inf = std::numeric_limits<double>::infinity();
constexpr double rate = 16000;

ModalBank bank_of(std::span<const Mode> modes, std::size_t channels = 1, double rate_hz = rate) {
  auto made = ModalBank::make(modes, channels, rate_hz);
  REQUIRE(made.has_value());
  return std::move(*made);
}

Mode unit_mode(double frequency_hz, double damping_ratio) {
  return {frequency_hz, damping_ratio, {1, 0, 0}, {1, 0, 0}};
}

std::vector<Mode> many_modes(std::size_t count) {
  std::vector<Mode> modes;
  Random random(5);
  for (std::size_t i = 0; i < count; ++i)
    modes.push_back({random.uniform(40, 7000),
                     random.uniform(0.002, 0.05),
                     {random.gaussian(), random.gaussian(), random.gaussian()},
                     {random.gaussian(), random.gaussian(), random.gaussian()}});
  return modes;
}

std::vector<double> answer(ModalBank& bank, const std::vector<Force>& forces) {
  std::vector<double> out(forces.size() * bank.channels());
  bank.advance(forces, out);
  return out;
}

/// A triangle with a peak of one newton: the sampled form of an impulse.
std::vector<Force> click(std::size_t samples) {
  std::vector<Force> forces(samples, Force{});
  forces[0] = {1, 0, 0};
  return forces;
}

bool has_denormal(std::span<const double> values) {
  return std::any_of(values.begin(), values.end(),
                     [](double v) { return std::fpclassify(v) == FP_SUBNORMAL; });
}

}  // namespace

TEST_CASE("A mode is the exact oscillator, for any force that is linear between samples") {
  for (const double frequency : {0.5, 37.0, 440.0, 3000.0, 7800.0})
    for (const double ratio : {0.0, 1e-3, 0.05, 0.5, 0.9}) {
      CAPTURE(frequency, ratio);
      const Mode mode = unit_mode(frequency, ratio);
      ModalBank bank = bank_of(std::span(&mode, 1));
      const double w = 2 * std::numbers::pi * frequency;
      const Oscillator o = Oscillator::resonance(1, w, ratio);
      const auto step = OscillatorStep::make(o, 1 / rate);
      REQUIRE(step.has_value());
      Random random(1);
      OscillatorState state;
      Force force{}, last{};
      for (int i = 0; i < 3000; ++i) {
        force[0] = random.uniform(-1, 1);
        double out = 0;
        bank.advance(std::span(&force, 1), std::span(&out, 1));
        state = step->advance(state, last[0], force[0]);
        last = force;
        const double a = force[0] - o.damping_n_s_m * state.v_mps - o.stiffness_n_m * state.x_m;
        REQUIRE(out == Approx(a).margin(2e-9));
      }
    }
}

TEST_CASE("A struck mode rings at its frequency and decays at its rate") {
  for (const auto& [frequency, ratio] :
       {std::pair{120.0, 0.02}, {440.0, 0.005}, {2500.0, 0.01}, {7000.0, 0.001}}) {
    CAPTURE(frequency, ratio);
    const Mode mode = unit_mode(frequency, ratio);
    ModalBank bank = bank_of(std::span(&mode, 1));
    const std::vector<double> ring = answer(bank, click(4000));
    const double w = 2 * std::numbers::pi * frequency, h = 1 / rate;
    const double damped = w * std::sqrt(1 - ratio * ratio);
    // After the click: y[n] = 2 e^{-zeta w h} cos(w_d h) y[n-1] - e^{-2 zeta w h} y[n-2].
    const double decay = std::exp(-ratio * w * h);
    for (std::size_t n = 4; n < ring.size(); ++n)
      REQUIRE(ring[n] ==
              Approx(2 * decay * std::cos(damped * h) * ring[n - 1] - decay * decay * ring[n - 2])
                  .margin(1e-13));
    // Its size: a triangle of area h on unit mass gives the initial v = h |sinc^2| of the
    // frequency.
    const double sinc = std::sin(w * h / 2) / (w * h / 2);
    double peak = 0;
    for (std::size_t n = 2; n < 400; ++n)
      peak = std::max(peak, std::abs(ring[n]) * std::exp(ratio * w * h * static_cast<double>(n)));
    CHECK(peak == Approx(w * h * sinc * sinc).epsilon(0.02));
  }
}

TEST_CASE("Steady vibration has the amplitude of the transfer function") {
  // a/f = -w^2/(w0^2 - w^2 + 2 i zeta w0 w)
  const Mode mode = unit_mode(300, 0.1);
  for (const double frequency : {100.0, 300.0, 900.0}) {
    ModalBank bank = bank_of(std::span(&mode, 1), 1, 200000);
    const double w = 2 * std::numbers::pi * frequency, w0 = 2 * std::numbers::pi * 300;
    double peak = 0;
    for (int i = 0; i < 40000; ++i) {
      const Force force{std::sin(w * i / 200000), 0, 0};
      double out = 0;
      bank.advance(std::span(&force, 1), std::span(&out, 1));
      if (i > 30000) peak = std::max(peak, std::abs(out));
    }
    const double gain = w * w / std::hypot(w0 * w0 - w * w, 2 * 0.1 * w0 * w);
    CHECK(peak == Approx(gain).epsilon(2e-3));
  }
}

TEST_CASE("Modes add up, and each channel weighs them and each axis drives them on its own") {
  const std::vector<Mode> modes = many_modes(11);  // not a whole group
  Random random(8);
  std::vector<Force> forces(500);
  for (Force& f : forces) f = {random.gaussian(), random.gaussian(), random.gaussian()};
  ModalBank bank = bank_of(modes, 3);
  const std::vector<double> together = answer(bank, forces);
  std::vector<double> sum(together.size(), 0.0);
  for (const Mode& mode : modes)
    for (std::size_t k = 0; k < 3; ++k) {
      const Mode one{
          mode.frequency_hz, mode.damping_ratio, mode.drive_1_kg, {mode.weight[k], 0, 0}};
      ModalBank alone = bank_of(std::span(&one, 1));
      const std::vector<double> part = answer(alone, forces);
      for (std::size_t n = 0; n < part.size(); ++n) sum[3 * n + k] += part[n];
    }
  for (std::size_t i = 0; i < sum.size(); ++i) REQUIRE(together[i] == Approx(sum[i]).margin(1e-10));
}

TEST_CASE("A split run is a whole run bit for bit") {
  const std::vector<Mode> modes = many_modes(32);
  Random random(2);
  std::vector<Force> forces(200);
  for (Force& f : forces) f = {random.gaussian(), 0, random.gaussian()};
  ModalBank whole = bank_of(modes, 2), split = bank_of(modes, 2);
  const std::vector<double> one = answer(whole, forces);
  std::vector<double> two(one.size());
  split.advance(std::span(forces).first(77), std::span(two).first(154));
  split.advance(std::span(forces).subspan(77), std::span(two).subspan(154));
  CHECK(one == two);
}

TEST_CASE("An undamped mode keeps ringing for ten million samples") {
  const Mode mode = unit_mode(441, 0);
  ModalBank bank = bank_of(std::span(&mode, 1));
  answer(bank, click(100));
  const auto energy = [&] { return std::hypot(bank.state()[0], bank.state()[4]); };
  const double at_first = energy();
  const std::vector<Force> silence(100'000, Force{});
  std::vector<double> out(silence.size());
  for (int i = 0; i < 100; ++i) bank.advance(silence, out);
  CHECK(energy() == Approx(at_first).epsilon(2e-9));
}

TEST_CASE("Silence never becomes denormal, and is silent") {
  ModalBank bank = bank_of(many_modes(32), 3);
  answer(bank, click(100));
  std::vector<double> out;
  for (int i = 0; i < 40; ++i) {
    out = answer(bank, std::vector<Force>(20'000, Force{}));
    REQUIRE_FALSE(has_denormal(bank.state()));
    REQUIRE_FALSE(has_denormal(out));
  }
  for (const double a : out) CHECK(std::abs(a) < 1e-25);
}

TEST_CASE("No force poisons a bank") {
  ModalBank bank = bank_of(many_modes(9), 3);
  for (const double bad : {not_a_number, inf, -inf, 1e308, -1e308, 5e-324, 1e-310}) {
    const std::vector<double> out = answer(bank, {{bad, bad, bad}, {0, bad, 0}, {bad, 0, bad}});
    for (const double a : out) CHECK(std::isfinite(a));
  }
  bank = bank_of(many_modes(9), 3);
  for (const double a : answer(bank, {{5e-324, 1e-310, not_a_number}})) CHECK(std::abs(a) < 1e-25);
}

TEST_CASE("Banks that cannot be are refused with a sentence") {
  const Mode good = unit_mode(100, 0.01);
  for (const double bad : {not_a_number, inf, -inf, -1.0, 1e308}) {
    Mode mode = good;
    mode.frequency_hz = bad;
    CHECK_FALSE(ModalBank::make(std::span(&mode, 1), 1, rate).has_value());
    mode = good;
    mode.damping_ratio = bad;
    CHECK_FALSE(ModalBank::make(std::span(&mode, 1), 1, rate).has_value());
    CHECK_FALSE(ModalBank::make(std::span(&good, 1), 1, bad).has_value());
    if (bad == -1.0) continue;
    mode = good;
    mode.drive_1_kg[2] = bad;
    CHECK_FALSE(ModalBank::make(std::span(&mode, 1), 1, rate).has_value());
    mode = good;
    mode.weight[1] = bad;
    CHECK_FALSE(ModalBank::make(std::span(&mode, 1), 1, rate).has_value());
  }
  CHECK_FALSE(ModalBank::make({}, 1, rate).has_value());
  CHECK_FALSE(ModalBank::make(std::span(&good, 1), 0, rate).has_value());
  CHECK_FALSE(ModalBank::make(std::span(&good, 1), 4, rate).has_value());
  const Mode high = unit_mode(9000, 0.01);
  const auto refused = ModalBank::make(std::span(&high, 1), 1, rate);
  REQUIRE_FALSE(refused.has_value());
  CHECK(refused.error().code == Errc::range);
  CHECK(refused.error().where == "mode 0: frequency_hz");
  CHECK(refused.error().expected == "0.016000 to 7840.000000 Hz");
  CHECK(refused.error().got == "9000.000000 Hz");
}

}  // namespace modal_bank_test
