#pragma once
// Tangential force of the cloth: bristles with the pre-sliding part of LuGre, exact for a straight
// piece of path. Fabrics do not follow Amontons' law: F_C = mu N0 (N/N0)^n (Wilson 1963; Ramkumar).
// Source: docs/reference/plant.md, Friction.

#include <array>
#include <cmath>

#include "sim/plant/near.hpp"

namespace weft::sim {

// Vectors in the plane of the cloth.

using Vector2 = std::array<double, 2>;

/// a x + b y
inline Vector2 sum(double a, const Vector2& x, double b, const Vector2& y) {
  return {a * x[0] + b * y[0], a * x[1] + b * y[1]};
}

/// Euclidean length; not guarded against overflow, for the quantities of a plant are small.
inline double size(const Vector2& x) {
  return std::sqrt(x[0] * x[0] + x[1] * x[1]);
}

struct Friction {
  double coefficient = 0.2;          ///< mu at the reference load; 0 switches friction off
  double reference_load_n = 5;       ///< N0
  double exponent = 0.9;             ///< n, 0.7 to 1 [E]
  double bristle_length_m = 150e-6;  ///< shear of the cloth before it slides [E]

  /// Friction of full sliding under the load `normal_n`.
  [[nodiscard]] double sliding_n(double normal_n) const {
    if (normal_n <= 0) return 0;
    return coefficient * reference_load_n * std::pow(normal_n / reference_load_n, exponent);
  }
};

/// The bristle's deflection as a share of full sliding, along the motion, after `displacement_m`.
/// |share| <= 1; closed form 1 - e^{-d/l} from rest.
inline Vector2 bristle_after(const Vector2& share, const Vector2& displacement_m, double length_m) {
  const double distance = std::sqrt(displacement_m[0] * displacement_m[0] +
                                    displacement_m[1] * displacement_m[1]);  // 0 below 1e-162 m
  if (distance <= 0) return share;
  const double decay = nearby_exp(-distance / length_m), taken = (1 - decay) / distance;
  return {displacement_m[0] * taken + decay * share[0],
          displacement_m[1] * taken + decay * share[1]};
}

/// The contact at one instant, as sensors see it that are faster than the stages.
struct SlidingContact {
  Vector2 place_m{};         ///< of the face's centre over the cloth, fabric frame
  Vector2 friction_n{};      ///< on the cloth
  double normal_n = 0;       ///< cloth's force on the face, >= 0
  double stiffness_n_m = 0;  ///< dF/d(indentation) of the whole face there
};

}  // namespace weft::sim
