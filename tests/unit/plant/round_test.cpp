#include "sim/plant/round.hpp"

#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "sim/plant/random.hpp"

namespace round_test {

using namespace weft::sim;

std::uint64_t bits_of(double x) {
  return std::bit_cast<std::uint64_t>(x);
}

TEST_CASE("nearest_whole has the bits of std::round") {
  constexpr double half = 0.5, huge = 0x1p52, endless = std::numeric_limits<double>::infinity();
  for (const double x : {0.0, half, std::nextafter(half, 0), std::nextafter(half, 1), 1.5, 2.5,
                         huge - half, huge - 1, huge, huge + 1, 1e300, endless})
    for (const double signed_x : {x, -x}) {
      INFO(signed_x);
      CHECK(bits_of(nearest_whole(signed_x)) == bits_of(std::round(signed_x)));
    }
  CHECK(std::isnan(nearest_whole(std::numeric_limits<double>::quiet_NaN())));
}

TEST_CASE("nearest_whole has the bits of std::round at random arguments of all sizes") {
  Random random(1);
  int different = 0;
  for (int i = 0; i < 100'000; ++i) {
    const double x = std::ldexp(random.uniform(-1, 1), static_cast<int>(random.bits() % 60) - 4);
    different += bits_of(nearest_whole(x)) != bits_of(std::round(x)) ? 1 : 0;
  }
  CHECK(different == 0);
}

}  // namespace round_test
