#pragma once
// Level Z: a rigid face pressed on springs that stand side by side and do not feel each other
// (Winkler). The depth follows from the force in closed form once it is known which taxels touch:
//   linear       p = (P/L) d            depth = (F' - sum t)/n,          F' = F L/(A P)
//   exponential  p = P (e^{d/L} - 1)    e^{depth/L} = (F' + n)/sum e^{t/L}, F' = F/(A P)
// with t <= 0 the heights below the highest point. Source: docs/reference/plant.md, Closed forms
// (13) and Levels.

#include "sim/plant/fabric_law.hpp"
#include "sim/plant/imprint/height_map.hpp"

namespace weft::sim {

/// Pressure of one spring under an indentation; both laws have the stiffness P/L at first touch.
struct SpringLaw {
  enum class Kind { linear, exponential };
  Kind kind = Kind::linear;
  double pressure_pa = 0;  ///< P
  double length_m = 0;     ///< L

  static SpringLaw linear(double stiffness_pa_m) {
    return {Kind::linear, stiffness_pa_m * 1e-3, 1e-3};
  }
  static SpringLaw cloth(const FabricLaw& law) {
    return {Kind::exponential, law.pressure_pa, law.lambda_m};
  }
};

/// The imprint of `map` pressed with `force_n` on its back, exact but for rounding, O(n log n).
/// Errors: range, for a map, force or law outside what `check` allows; P in 1e-6 to 1e12 Pa,
/// L in 1e-9 to 1 m.
Result<Imprint> press_winkler(const HeightMap& map, const SpringLaw& law, double force_n);

}  // namespace weft::sim
