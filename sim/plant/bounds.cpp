#include "sim/plant/bounds.hpp"

#include <array>
#include <cstdio>
#include <string>

namespace weft::sim {

namespace {

std::string text(double value) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%g", value);
  return buffer.data();
}

}  // namespace

Status check_bounds(const char* where, std::initializer_list<Bound> bounds) {
  for (const Bound& bound : bounds)
    if (!inside(bound.value, bound.low, bound.high))
      return fail({.code = Errc::range,
                   .where = where,
                   .what = std::string(bound.name) + " is outside what can be simulated",
                   .expected = text(bound.low) + " to " + text(bound.high),
                   .got = text(bound.value)});
  return {};
}

}  // namespace weft::sim
