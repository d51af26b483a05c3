#include "sim/plant/pads.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

namespace pads_test {

using namespace weft::sim;

namespace {

PadParams ideal() {
  PadParams params;
  params.gain_spread = params.gap_spread = params.crosstalk = params.creep = 0;
  params.hysteresis = params.drift_counts = params.noise_counts = 0;
  params.baseline_low_counts = params.baseline_high_counts = 5000;
  return params;
}

std::uint16_t counts_under(PadArray& pads, double pressure_pa, std::size_t pad = 5) {
  pads.convert(pad, pressure_pa, 1);
  return pads.counts()[pad];
}

}  // namespace

TEST_CASE("the pad is a plate capacitor with the dielectric and the gap in series") {
  const PadParams params;
  CHECK(capacitance_f(params, 10e-6) == Approx(0.7213e-12).epsilon(2e-3));
  CHECK(capacitance_f(params, 0) == Approx(0.9736e-12).epsilon(2e-3));
}

TEST_CASE("counts rise with pressure, less and less, to the closed gap") {
  PadArray pads(ideal(), 1);
  double last = counts_under(pads, 0), step = 1e9;
  CHECK(last == 5000);
  for (double pressure = 10e3; pressure <= 200e3; pressure += 10e3) {
    const double now = counts_under(pads, pressure);
    CHECK(now > last);
    CHECK(now - last <= step);
    step = now - last;
    last = now;
  }
  CHECK(counts_under(pads, 19.5e3) - 5000 == Approx(450).margin(60));  // 5 N over the face
  const double halved =
      (capacitance_f(ideal(), 5e-6) - capacitance_f(ideal(), 10e-6)) / ideal().lsb_f;
  CHECK(counts_under(pads, 20e3) == Approx(5000 + halved).margin(1));
  const double closed = (capacitance_f(ideal(), 0) - capacitance_f(ideal(), 10e-6)) / ideal().lsb_f;
  CHECK(counts_under(pads, 1e12) == Approx(5000 + closed).margin(1));
}

TEST_CASE("a count is the nearest integer, held to 16 bits, never a NaN") {
  CHECK(quantise(1233.5) == 1234);
  CHECK(quantise(1233.4) == 1233);
  CHECK(quantise(-3) == 0);
  CHECK(quantise(1e9) == 65535);
  CHECK(quantise(std::numeric_limits<double>::quiet_NaN()) == 0);
  CHECK(quantise(std::numeric_limits<double>::infinity()) == 65535);
}

TEST_CASE("a pad that was pressed beyond all numbers reads the cloth again afterwards") {
  for (const double absurd :
       {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN(), 1e300}) {
    PadParams params = ideal();
    params.creep = 0.2;
    params.creep_time_s = 0.01;
    params.hysteresis = 0.01;
    PadArray pads(params, 1), fresh(params, 1);
    pads.reset(1, 1);
    fresh.reset(1, 1);
    CHECK(counts_under(pads, absurd) == counts_under(fresh, 1e15));
    for (int i = 0; i < 37; ++i) pads.convert(5, 10e3, static_cast<std::uint64_t>(i));
    for (int i = 0; i < 37; ++i) fresh.convert(5, 10e3, static_cast<std::uint64_t>(i));
    CHECK(pads.counts()[5] > 0);
    CHECK(pads.counts() == fresh.counts());
  }
}

TEST_CASE("pads that cannot be are refused by name") {
  CHECK(check(PadParams{}));
  const auto refused = [](double PadParams::*field, double value) {
    PadParams params;
    params.*field = value;
    const weft::Status s = check(params);
    return s ? std::string() : s.error().what;
  };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK_THAT(refused(&PadParams::gap_m, nan), Catch::Contains("gap"));
  CHECK_THAT(refused(&PadParams::lsb_f, 0), Catch::Contains("[F]"));
  CHECK_THAT(refused(&PadParams::baseline_high_counts, 100), Catch::Contains("highest baseline"));
  CHECK_THAT(refused(&PadParams::creep_time_s, -1), Catch::Contains("creep time"));
  CHECK_THAT(refused(&PadParams::hysteresis, 1), Catch::Contains("hysteresis"));
}

TEST_CASE("a loaded pad leaks into its four neighbours and into no other") {
  PadParams params = ideal();
  params.crosstalk = 0.04;
  PadArray pads(params, 1);
  const double own = counts_under(pads, 40e3, 5) - 5000.0;
  for (std::size_t pad = 0; pad < pad_count; ++pad) {
    if (pad == 5) continue;
    const bool neighbour = pad == 1 || pad == 4 || pad == 6 || pad == 9;
    CHECK(counts_under(pads, 0, pad) - 5000.0 == Approx(neighbour ? 0.04 * own : 0).margin(0.6));
  }
}

TEST_CASE("creep adds its share with its time constant") {
  PadParams params = ideal();
  params.creep = 0.2;
  params.creep_time_s = 2;
  PadArray pads(params, 1), reference(ideal(), 1);
  const double first = counts_under(pads, 10e3);
  for (int i = 0; i < 37 * 20; ++i) pads.convert(5, 10e3, static_cast<std::uint64_t>(i));
  CHECK(first == Approx(counts_under(reference, 10e3)).margin(2));
  CHECK(counts_under(pads, 10e3) == Approx(counts_under(reference, 12e3)).margin(1));
}

TEST_CASE("noise has its size, is white, and belongs to the frame and not to the call") {
  PadParams params = ideal();
  params.noise_counts = 20;
  PadArray one(params, 1), two(params, 1);
  double sum = 0, squares = 0, product = 0, last = 0;
  constexpr int frames = 4000;
  for (int i = 0; i < frames; ++i) {
    one.convert(3, 0, static_cast<std::uint64_t>(i));
    const double value = one.counts()[3] - 5000.0;
    sum += value;
    squares += value * value;
    product += value * last;
    last = value;
  }
  CHECK(sum / frames == Approx(0).margin(1.5));
  CHECK(std::sqrt(squares / frames) == Approx(20).epsilon(0.05));
  CHECK(std::abs(product / squares) < 0.05);
  two.convert(3, 0, frames - 1);
  CHECK(two.counts()[3] == one.counts()[3]);
}

TEST_CASE("pads of one sensor differ, and another sensor is another") {
  PadArray one(PadParams{}, 1), same(PadParams{}, 1), other(PadParams{}, 2);
  CHECK(one.counts() == same.counts());
  CHECK(one.counts() != other.counts());
  CHECK(one.counts()[0] != one.counts()[1]);
  for (const auto count : one.counts()) CHECK((count >= 4000 && count <= 12000));
}

TEST_CASE("drift stays near its standard deviation for as long as one likes") {
  PadParams params = ideal();
  params.drift_counts = 3;
  params.drift_time_s = 10;
  PadArray pads(params, 1);
  pads.reset(8, 1);
  double squares = 0;
  constexpr int frames = 100000;
  for (int i = 0; i < frames; ++i) {
    pads.convert(0, 0, static_cast<std::uint64_t>(i));
    const double value = pads.counts()[0] - 5000.0;
    squares += value * value / frames;
  }
  CHECK(std::sqrt(squares) == Approx(3).epsilon(0.2));
}

TEST_CASE("drift has no mean of its own at the correlation time that it has by default") {
  PadParams params = ideal();
  params.drift_counts = 200;
  params.drift_time_s = PadParams{}.drift_time_s;
  constexpr int sensors = 60;
  constexpr std::uint64_t frames = 100000;  // 45 minutes, four and a half correlation times
  double sum = 0;
  for (std::uint64_t sensor = 0; sensor < sensors; ++sensor) {
    PadArray pads(params, 1);
    pads.reset(sensor, 1);
    for (std::uint64_t frame = 0; frame < frames; ++frame) pads.convert_stages({}, frame);
    for (const std::uint16_t count : pads.counts()) sum += count - 5000.0;
  }
  constexpr double pads_seen = sensors * double{pad_count};
  CHECK(std::abs(sum / pads_seen) < 3 * 200 / std::sqrt(pads_seen));
}

TEST_CASE("a scan at once gives the counts of its stages one by one") {
  PadArray whole(PadParams{}, 3), staged(PadParams{}, 3);
  whole.reset(5, 1.1);
  staged.reset(5, 1.1);
  std::array<double, pad_count> pressure_pa{};
  for (std::uint64_t frame = 0; frame < 50; ++frame) {
    for (std::size_t pad = 0; pad < pad_count; ++pad)
      pressure_pa[pad] = 1e3 * static_cast<double>((frame * 7 + pad * pad) % 41);
    whole.convert_stages(pressure_pa, frame);
    for (int stage = 0; stage < pad_timing::stages; ++stage)
      staged.convert_stages(pressure_pa, frame, stage, stage + 1);
    REQUIRE(whole.counts() == staged.counts());
  }
}

}  // namespace pads_test
