#include "classifier/design/power_law.hpp"

#include <algorithm>
#include <cmath>

namespace weft::classifier::design {

double PowerLaw::error_at(double trained) const {
  return std::clamp(floor + scale * std::pow(trained, -exponent), 0.0, 1.0);
}

PowerLaw fit_power_law(std::span<const ErrorPoint> points, double exponent) {
  double w = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const ErrorPoint& p : points) {
    const double at = std::pow(p.trained, -exponent);
    w += p.weight;
    x += p.weight * at;
    y += p.weight * p.error;
    xx += p.weight * at * at;
    xy += p.weight * at * p.error;
  }
  const double determinant = w * xx - x * x;
  PowerLaw law{y / w, 0, exponent};  // a flat line: no learning is seen
  if (!(determinant > 1e-12 * w * xx)) return law;
  const double scale = (w * xy - x * y) / determinant;
  if (scale <= 0) return law;
  law.scale = scale;
  law.floor = (y - scale * x) / w;
  if (law.floor < 0) law = {0, xy / xx, exponent};
  return law;
}

double misfit(std::span<const ErrorPoint> points, const PowerLaw& law) {
  double sum = 0;
  for (const ErrorPoint& p : points) {
    const double off = p.error - (law.floor + law.scale * std::pow(p.trained, -law.exponent));
    sum += p.weight * off * off;
  }
  return sum;
}

const std::vector<double>& exponents() {
  static const std::vector<double> list{0.25, 0.375, 0.5, 0.75, 1, 1.25, 1.5, 2};
  return list;
}

PowerLaw fit_power_law(std::span<const ErrorPoint> points) {
  PowerLaw best = fit_power_law(points, exponents().front());
  for (const double exponent : exponents()) {
    const PowerLaw law = fit_power_law(points, exponent);
    if (misfit(points, law) < misfit(points, best)) best = law;
  }
  return best;
}

}  // namespace weft::classifier::design
