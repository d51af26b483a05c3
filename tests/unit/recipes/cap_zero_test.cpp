// From where the caps count: the load at rest until the sensor has its zero, the zero from then on.

#include "recipes/control/cap_zero.hpp"

#include <catch2/catch.hpp>
#include <cmath>

namespace cap_zero_test {

using namespace weft::recipes;

namespace {

constexpr double plate_n = 17.65;  // 1.8 kg

Load down(double force_n) {
  return {{0, 0, force_n}, {force_n / 10, 0, 0}};
}

double judged_n(CapZero& zero, double reading_n, bool people = false) {
  const Load load = zero.step(down(reading_n), people);
  CHECK(load.torque_nm[0] == Approx(load.force_n[2] / 10).margin(1e-12));
  return load.force_n[2];
}

}  // namespace

TEST_CASE("What lies on the sensor at the start is none of the caps', what comes to it is") {
  CapZero zero;
  CHECK(judged_n(zero, plate_n) == 0);
  CHECK(judged_n(zero, plate_n + 11) == Approx(11));
  CHECK(judged_n(zero, plate_n - 11) == Approx(-11));  // hidden by the plate's weight before
  CHECK(judged_n(zero, 0) == Approx(-plate_n));        // nobody has asked for a zero
}

TEST_CASE("Once its zero is asked for the sensor may take it at any time, once and for all") {
  CapZero zero;
  judged_n(zero, plate_n);
  zero.asked();
  CHECK(judged_n(zero, plate_n + 12) == Approx(12));  // not yet: the request may be lost
  CHECK(judged_n(zero, 0.02) == 0.02);
  CHECK(judged_n(zero, 12) == 12);
  CHECK(judged_n(zero, plate_n) == plate_n);  // a sensor that lost its zero is over its cap
}

TEST_CASE("A zero that is known counts, also where the sensor had one before") {
  CapZero zero;
  CHECK(judged_n(zero, 0.1) == 0);
  zero.asked();
  zero.taken();
  CHECK(judged_n(zero, 0.1) == 0.1);
}

TEST_CASE("People at the plate may change what lies on it; what follows counts from that") {
  CapZero zero;
  zero.taken();
  CHECK(judged_n(zero, 3, true) == 0);
  CHECK(judged_n(zero, 13, true) == 0);
  CHECK(judged_n(zero, 13) == 0);
  CHECK(judged_n(zero, 24) == Approx(11));
  zero.asked();
  CHECK(judged_n(zero, 0.1) == 0.1);
}

TEST_CASE("A reading that is no number stays none") {
  CapZero zero;
  judged_n(zero, plate_n);
  CHECK(std::isnan(zero.step({{0, 0, std::nan("")}, {}}, false).force_n[2]));
}

}  // namespace cap_zero_test
