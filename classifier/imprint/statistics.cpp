#include "classifier/imprint/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace weft::classifier::imprint {
namespace {

double circular(std::span<const EdgeTaxel> edges) {
  double cosine = 0.0, sine = 0.0;  // of twice the angle
  for (const EdgeTaxel& edge : edges) {
    const double x = edge.x / edge.strength, y = edge.y / edge.strength;
    cosine += x * x - y * y;
    sine += 2.0 * x * y;
  }
  // 1 - R from what turns away from the mean direction: R itself cannot tell small spreads from
  // rounding.
  const double middle = 0.5 * std::atan2(sine, cosine);
  const double along_x = std::cos(middle), along_y = std::sin(middle);
  double away = 0.0;
  for (const EdgeTaxel& edge : edges) {
    const double turned = (edge.y * along_x - edge.x * along_y) / edge.strength;
    away += 2.0 * turned * turned;
  }
  const auto n = static_cast<double>(edges.size());
  away = std::min(away / n, 1.0 - 1.0 / n);
  return std::sqrt(-2.0 * std::log1p(-away)) / 2.0;
}

}  // namespace

Moments moments(std::span<const double> values) {
  if (values.empty()) return {};
  const auto n = static_cast<double>(values.size());
  double sum = 0.0;
  for (const double value : values) sum += value;
  const double mean = sum / n;
  double square = 0.0;
  for (const double value : values) square += (value - mean) * (value - mean);
  return {mean, std::sqrt(square / n)};
}

double orientation_spread(std::span<const EdgeTaxel> edges, OrientationSpread kind) {
  if (edges.size() < 2) return 0.0;
  if (kind == OrientationSpread::circular) return circular(edges);
  std::vector<double> angles;
  for (const EdgeTaxel& edge : edges) angles.push_back(std::atan2(edge.y, edge.x));
  return moments(angles).deviation;
}

}  // namespace weft::classifier::imprint
