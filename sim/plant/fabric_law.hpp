#pragma once
// The compression law of a cloth and how it follows from the KES-FB3 figures that textile tables
// print. Source: docs/reference/plant.md, Contact law.

#include "protocols/base/result.hpp"

namespace weft::sim {

/// What KES-FB3 prints for one cloth, pressed from 49 Pa to 4.903 kPa (50 gf/cm2).
struct KesCompression {
  double linearity = 0;   ///< LC, in (0, 1)
  double work_j_m2 = 0;   ///< WC; 1 gf cm/cm2 = 0.980665 J/m2
  double resilience = 0;  ///< RC as a fraction, in (0, 1]
};

/// Local pressure p = p_s (e^{d/lambda} G - 1) under an indentation d; stiffness grows with load.
struct FabricLaw {
  double lambda_m = 0;     ///< indentation over which the pressure grows by e
  double pressure_pa = 0;  ///< p_s
  double hysteresis = 0;   ///< eta: unloading follows (1 - eta)/(1 + eta) of the loading curve
};

constexpr double kes_peak_pressure_pa = 4903.325;  ///< 50 gf/cm2
constexpr double kes_work_j_m2 = 0.980665;         ///< 1 gf cm/cm2

/// The law that gives exactly these LC, WC and RC.
/// Errors: range, for numbers that no law of this form has.
Result<FabricLaw> law_from_kes(const KesCompression& kes);

/// A plate with no cloth on it: stiff (5e6 N/m at 5 N under the whole face), without memory.
constexpr FabricLaw bare_plate_law() {
  return {1e-6, 1000, 0};
}

}  // namespace weft::sim
