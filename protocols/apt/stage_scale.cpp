#include "protocols/apt/stage_scale.hpp"

#include <cmath>
#include <limits>
#include <string>

namespace weft::protocols::apt {
namespace {

Result<std::int32_t> to_counts(double value, double counts_per_value, const char* what) {
  const double counts = std::round(value * counts_per_value);
  constexpr double lowest = std::numeric_limits<std::int32_t>::min();
  constexpr double highest = std::numeric_limits<std::int32_t>::max();
  if (counts >= lowest && counts <= highest) return static_cast<std::int32_t>(counts);
  return fail({.code = Errc::range,
               .what = std::string(what) + " exceeds the 32-bit field of the protocol",
               .expected = "at most " + std::to_string(highest / counts_per_value),
               .got = std::to_string(value)});
}

}  // namespace

Result<std::int32_t> position_to_counts(const StageScale& scale, double value) {
  return to_counts(value, scale.counts_per_unit, "position");
}

Result<std::int32_t> velocity_to_counts(const StageScale& scale, double value) {
  return to_counts(value, scale.velocity_counts, "velocity");
}

Result<std::int32_t> acceleration_to_counts(const StageScale& scale, double value) {
  return to_counts(value, scale.acceleration_counts, "acceleration");
}

}  // namespace weft::protocols::apt
