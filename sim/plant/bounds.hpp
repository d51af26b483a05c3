#pragma once
// Parameters within what can be simulated.

#include <initializer_list>

#include "protocols/base/result.hpp"

namespace weft::sim {

/// False for NaN.
constexpr bool inside(double value, double low, double high) {
  return value >= low && value <= high;
}

struct Bound {
  const char* name;
  double value, low, high;
};

/// The first parameter outside its bounds, or NaN. Errors: range, naming it and `where` it stands.
Status check_bounds(const char* where, std::initializer_list<Bound> bounds);

}  // namespace weft::sim
