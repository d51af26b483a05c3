#pragma once
// A number within its bounds.

namespace weft::sim {

/// False for NaN.
constexpr bool inside(double value, double low, double high) {
  return value >= low && value <= high;
}

}  // namespace weft::sim
