#pragma once
// Checks that parameters are within the range of the simulation.

#include <initializer_list>
#include <string>
#include <string_view>

#include "protocols/base/result.hpp"

namespace weft::sim {

/// False for NaN.
constexpr bool inside(double value, double low, double high) {
  return value >= low && value <= high;
}

/// `value` in the printf format `format`, up to 63 characters.
std::string printed(const char* format, double value);

struct Bound {
  const char* name;
  double value, low, high;
};

/// Finds the first parameter outside its bounds, or NaN. Errors: range, with its name and `where`.
Status check_bounds(const char* where, std::initializer_list<Bound> bounds);

/// A number with its place, its limits and the error text for a number outside them.
struct Limit {
  std::string_view where, what;
  double value, low, high;
  std::string_view expected = {};  ///< the bounds in words; empty: "low to high"
  bool whole = false;              ///< a count: its error shows no decimals
};
/// Errors: range, for the first number outside its limits, or NaN.
Status check_limits(std::initializer_list<Limit> limits);

}  // namespace weft::sim
