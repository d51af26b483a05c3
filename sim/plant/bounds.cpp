#include "sim/plant/bounds.hpp"

#include <array>
#include <cstdint>
#include <cstdio>
#include <string>

namespace weft::sim {

std::string printed(const char* format, double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

Status check_bounds(const char* where, std::initializer_list<Bound> bounds) {
  for (const Bound& bound : bounds)
    if (!inside(bound.value, bound.low, bound.high))
      return fail({.code = Errc::range,
                   .where = where,
                   .what = std::string(bound.name) + " out of range",
                   .expected = printed("%g to ", bound.low) + printed("%g", bound.high),
                   .got = printed("%g", bound.value)});
  return {};
}

Status check_limits(std::initializer_list<Limit> limits) {
  for (const Limit& limit : limits) {
    if (inside(limit.value, limit.low, limit.high)) continue;
    const std::string bounds = std::to_string(limit.low) + " to " + std::to_string(limit.high);
    return fail({.code = Errc::range,
                 .where = std::string(limit.where),
                 .what = std::string(limit.what),
                 .expected = limit.expected.empty() ? bounds : std::string(limit.expected),
                 .got = limit.whole ? std::to_string(static_cast<std::int64_t>(limit.value))
                                    : std::to_string(limit.value)});
  }
  return {};
}

}  // namespace weft::sim
