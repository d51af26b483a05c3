#pragma once
// std::round without a call: the same bits for every argument.

#include <cmath>
#include <cstdint>

namespace weft::sim {

/// The nearest whole number; halves are rounded away from zero. Sign of zero, infinities and NaN
/// are those of std::round.
inline double nearest_whole(double x) {
  constexpr double all_whole = 4503599627370496;  // 2^52: every double above is whole
  if (!(std::abs(x) < all_whole)) return x;
  const auto towards_zero = static_cast<double>(static_cast<std::int64_t>(x));
  const double left = x - towards_zero;  // exact
  const double up = left >= 0.5 ? 1 : left <= -0.5 ? -1 : 0;
  return std::copysign(towards_zero + up, x);
}

}  // namespace weft::sim
