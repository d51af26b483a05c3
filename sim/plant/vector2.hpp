#pragma once
// Vectors in the plane of the cloth.

#include <array>
#include <cmath>

namespace weft::sim {

using Vector2 = std::array<double, 2>;

/// a x + b y
inline Vector2 sum(double a, const Vector2& x, double b, const Vector2& y) {
  return {a * x[0] + b * y[0], a * x[1] + b * y[1]};
}

/// Euclidean length; not guarded against overflow, for the quantities of a plant are small.
inline double size(const Vector2& x) {
  return std::sqrt(x[0] * x[0] + x[1] * x[1]);
}

}  // namespace weft::sim
