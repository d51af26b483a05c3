#pragma once
// How an error falls with the training: error(m) = floor + scale m^-exponent (Cortes and others
// 1994; Figueroa and others 2012, who weight the points).

#include <span>
#include <vector>

namespace weft::classifier::design {

struct PowerLaw {
  double floor = 0;  ///< what no training removes, 0 to 1
  double scale = 0;  ///< >= 0
  double exponent = 1;
  [[nodiscard]] double error_at(double trained) const;  ///< within 0 to 1
};

/// A measured error and its weight, 1 / variance.
struct ErrorPoint {
  double trained = 1;  ///< repetitions, positive
  double error = 0;
  double weight = 1;
};

/// The weighted least-squares law of this exponent, floor and scale not negative; in closed form.
PowerLaw fit_power_law(std::span<const ErrorPoint> points, double exponent);
/// Sum of weight (error - law)^2.
double misfit(std::span<const ErrorPoint> points, const PowerLaw& law);

/// Exponents that are tried: 0.25 to 2, from learning that hardly ends to one that soon has.
const std::vector<double>& exponents();
/// The best of those.
PowerLaw fit_power_law(std::span<const ErrorPoint> points);

}  // namespace weft::classifier::design
