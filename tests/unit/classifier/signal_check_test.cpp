#include "classifier/features/signal_check.hpp"

#include <catch2/catch.hpp>
#include <cmath>

#include "classifier/base/random.hpp"

namespace weft::classifier::signal_check_test {
namespace {

// Whole numbers from -10 to 10 about a level.
std::vector<double> noise(std::size_t count, double level) {
  RandomEngine engine(3);
  std::vector<double> out;
  for (std::size_t i = 0; i < count; ++i)
    out.push_back(level + static_cast<double>(engine() % 21) - 10.0);
  return out;
}

}  // namespace

TEST_CASE("a signal without spread is constant, whatever its unit") {
  for (const double level : {0.0, 0.1, 1e-15, 1e15, -7.0}) {
    std::vector<double> signal(100, level);
    CHECK(check_signal(signal).constant);
    signal[50] = std::nextafter(level, HUGE_VAL);
    if (level != 0.0) CHECK(check_signal(signal).constant);
    signal[50] = level + (level == 0.0 ? 1.0 : 1e-9 * level);
    CHECK_FALSE(check_signal(signal).constant);
  }
  CHECK(check_signal({}).constant);
}

TEST_CASE("digits that a level leaves are counted") {
  CHECK(check_signal(noise(200, 0)).digits > 15);
  CHECK(check_signal(noise(200, 1e12)).digits == Approx(4.7).margin(0.2));
  CHECK(check_signal(noise(200, 1e15)).digits == Approx(1.7).margin(0.2));
  CHECK(check_signal(noise(2000, 1e15)).deviation == Approx(std::sqrt(440.0 / 12)).epsilon(0.05));
}

TEST_CASE(
    "a clock, a counter that begins anew and one with lost frames only rise; noise does not") {
  std::vector<double> clock, counter, lossy, nibble, slow, ramp, triangle;
  for (int i = 0; i < 300; ++i) {
    clock.push_back(1.7e12 + 10 * i + i % 3);
    counter.push_back(i % 256);
    lossy.push_back(i + i / 50);
    nibble.push_back(i % 16);
    slow.push_back(1000 + 10 * (i / 4));
    ramp.push_back(std::floor(i / 10.0 + 2 * std::sin(i / 7.0)));
    triangle.push_back(std::abs(i % 40 - 20));
  }
  for (std::vector<double>* rising : {&clock, &counter, &lossy, &nibble, &slow}) {
    CHECK(check_signal(*rising).only_rises);
    CHECK_FALSE(check_signal(*rising).only_falls);
    for (double& value : *rising) value = -value;
    CHECK_FALSE(check_signal(*rising).only_rises);
    CHECK(check_signal(*rising).only_falls);
  }
  for (const std::vector<double>& other : {ramp, triangle, noise(300, 0)})
    CHECK_FALSE((check_signal(other).only_rises || check_signal(other).only_falls));
  CHECK_FALSE(check_signal(std::vector<double>{1, 2, 3}).only_rises);
}

TEST_CASE("a limit is where a moving signal stays") {
  std::vector<double> signal = noise(300, 1000);
  CHECK_FALSE(check_signal(signal).high.held);
  for (std::size_t i = 100; i < 120; ++i) signal[i] = 1023;
  const SignalState state = check_signal(signal);
  CHECK(state.high.held);
  CHECK(state.high.value == 1023);
  CHECK_FALSE(state.low.held);
  std::vector<double> steps;  // a slow sensor stays at every value for a while
  for (int i = 0; i < 300; ++i) steps.push_back(std::round(10 * std::sin(i / 50.0)));
  CHECK_FALSE(check_signal(steps).high.held);
  std::vector<double> two_values(100, 0.0);
  for (std::size_t i = 20; i < 60; ++i) two_values[i] = 1.0;
  CHECK_FALSE(check_signal(two_values).high.held);
}

}  // namespace weft::classifier::signal_check_test
