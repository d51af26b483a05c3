// Quanta are the results of std::round(), and the range has the stated ends.

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <random>

#include "daemon/storage/recorder/chunk.hpp"

namespace chunk_test {

using namespace weft;
using namespace weft::daemon;

namespace {

constexpr std::size_t axes = 6;

/// The quantum of the first force; empty if it cannot be recorded.
std::optional<std::int32_t> recorded(double force_n) {
  Bytes row(row_bytes(Stream::wrench, axes));
  WrenchSample sample;
  sample.force_n = {force_n, 0, 0};
  if (const Status done = encode_wrench(row, TimePoint{}, sample); !done) {
    CHECK(done.error().code == Errc::range);
    return std::nullopt;
  }
  WrenchStream stream;
  decode_wrench(row, stream);
  return stream.quanta.front();
}

void check_rounded(double force_n) {
  INFO(force_n);
  const double quanta = std::round(force_n * force_quanta_per_n);
  const bool fits = std::abs(quanta) <= std::numeric_limits<std::int32_t>::max();
  const auto found = recorded(force_n);
  REQUIRE(found.has_value() == fits);
  if (fits) CHECK(*found == quanta);
}

}  // namespace

TEST_CASE("a value becomes the nearest quantum, half of one the one away from zero") {
  std::mt19937_64 random(11);
  for (int i = 0; i < 2000; ++i) {
    const double whole = std::floor(std::ldexp(static_cast<double>(random() >> 11), -53 + i % 32));
    for (const double quanta : {whole, whole + 0.5, whole + 0.25, whole + 0.75})
      for (const double sign : {1.0, -1.0}) {
        const double force_n = sign * quanta / force_quanta_per_n;
        check_rounded(force_n);
        check_rounded(std::nextafter(force_n, 1e9));
        check_rounded(std::nextafter(force_n, -1e9));
      }
  }
  CHECK(recorded(0.5e-6) == 1);
  CHECK(recorded(-0.5e-6) == -1);
  CHECK(recorded(-0.0) == 0);
}

TEST_CASE("the range ends with the largest quantum, and what is no number is refused") {
  constexpr double largest_n = std::numeric_limits<std::int32_t>::max() / force_quanta_per_n;
  for (const double sign : {1.0, -1.0}) {
    for (double quanta = -1; quanta <= 2; quanta += 0.25)
      check_rounded(sign * (largest_n + quanta / force_quanta_per_n));
    CHECK_FALSE(recorded(sign * std::numeric_limits<double>::infinity()));
    CHECK_FALSE(recorded(sign * 1e300));
  }
  CHECK_FALSE(recorded(std::numeric_limits<double>::quiet_NaN()));
}

}  // namespace chunk_test
