#pragma once
// Checks of an imprint: the bed's law, spring by spring, and the force of all taxels.

#include <cmath>

#include "sim/plant/imprint/height_map.hpp"

namespace weft::sim::test {

/// Pressure of the law at an indentation; 0 out of contact [Pa].
inline double spring_pressure_pa(const SpringLaw& law, double indentation_m) {
  if (!(indentation_m > 0)) return 0;
  const double d = indentation_m / law.length_m;
  return law.pressure_pa * (law.kind == SpringLaw::Kind::linear ? d : std::expm1(d));
}

/// Sum of pressure times area [N].
inline double total_force_n(const Imprint& imprint, double cell_m2) {
  double sum = 0;
  for (const double p : imprint.pressure_pa) sum += p;
  return sum * cell_m2;
}

}  // namespace weft::sim::test
