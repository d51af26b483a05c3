#include "daemon/analysis/calibration/press.hpp"

#include <algorithm>
#include <cmath>

#include "daemon/analysis/calibration/signal.hpp"
#include "sim/plant/contact.hpp"

namespace weft::daemon::calibration {
namespace {

constexpr double least_rest_n = 0.01;  // 40 Pa, negligible compared with a pad's 20 kPa
constexpr double most_ratio = 0.9;
constexpr double most_of_range = 0.7;  // share of a closed pad's counts, for the largest level
constexpr double mean_neighbours = 3;  // per pad in a square of 16
constexpr double closed_pa = 1e12, almost_closed = 0.999;
constexpr int halvings = 100;

/// Counts under a pressure, minus those at `ratio` times that pressure.
double counts_above_rest(const sim::PadParams& pads, double pressure_pa, double ratio) {
  return counts_under(pads, pressure_pa) - counts_under(pads, ratio * pressure_pa);
}

/// Maximum of counts_above_rest(): counts are a hyperbola C p/(p + h) of the pressure.
double best_pressure_pa(const sim::PadParams& pads, double ratio) {
  if (!(ratio > 0)) return closed_pa;
  const double half_pa = pressure_for(pads, 0.5 * counts_under(pads, closed_pa));
  return std::min(closed_pa, half_pa / std::sqrt(ratio));
}

double pressure_above_rest(const sim::PadParams& pads, double counts, double ratio) {
  double low_pa = 0, high_pa = best_pressure_pa(pads, ratio);
  for (int i = 0; i < halvings; ++i) {
    const double middle_pa = 0.5 * (low_pa + high_pa);
    (counts_above_rest(pads, middle_pa, ratio) < counts ? low_pa : high_pa) = middle_pa;
  }
  return high_pa;
}

double plant_level(const Stroke& stroke, double scale) {
  return std::max(1.0, mean(stroke.level) / scale);
}

}  // namespace

double counts_under(const sim::PadParams& pads, double pressure_pa) {
  const double gap_m = pads.gap_m * pads.gap_pressure_pa / (pads.gap_pressure_pa + pressure_pa);
  const double change_f = sim::capacitance_f(pads, gap_m) - sim::capacitance_f(pads, pads.gap_m);
  return (1 + mean_neighbours * pads.crosstalk) * change_f / pads.lsb_f;
}

double pressure_for(const sim::PadParams& pads, double counts) {
  const double held = std::clamp(counts, 0.0, almost_closed * counts_under(pads, closed_pa));
  double low_pa = 0, high_pa = closed_pa;
  for (int i = 0; i < halvings; ++i) {  // bisects the square root: small pressures need more digits
    const double root = 0.5 * (std::sqrt(low_pa) + std::sqrt(high_pa)), middle_pa = root * root;
    (counts_under(pads, middle_pa) < held ? low_pa : high_pa) = middle_pa;
  }
  return high_pa;
}

double rest_ratio(const Stroke& stroke) {
  if (!(stroke.force_n > 0) || !(stroke.rest_force_n > 0)) return 0;
  return std::min(most_ratio, stroke.rest_force_n / stroke.force_n);
}

double count_scale(const RecordingView& view, const sim::PadParams& pads) {
  double out = 1;
  for (const Stroke& stroke : view.strokes) {
    const double ratio = rest_ratio(stroke);
    const double most = counts_above_rest(pads, best_pressure_pa(pads, ratio), ratio);
    out = std::max(out, mean(stroke.level) / (most_of_range * most));
  }
  return out;
}

Press plan_press(std::span<const Stroke* const> strokes, const sim::PadParams& pads, double scale) {
  const double area_m2 = sim::ContactGeometry{}.face_area_m2();
  std::vector<double> rests_n;
  for (const Stroke* stroke : strokes) {
    if (!(stroke->force_n > 0) || std::isnan(stroke->rest_force_n)) continue;
    const double ratio = rest_ratio(*stroke);
    rests_n.push_back(ratio * area_m2 *
                      pressure_above_rest(pads, plant_level(*stroke, scale), ratio));
  }
  const double rest_n = mean(rests_n);
  Press out{std::max(least_rest_n, rest_n), {}};
  const double idle = rest_n > 0 ? counts_under(pads, rest_n / area_m2) : 0;
  for (const Stroke* stroke : strokes)
    out.force_n.push_back(
        std::max(out.rest_n, area_m2 * pressure_for(pads, plant_level(*stroke, scale) + idle)));
  return out;
}

}  // namespace weft::daemon::calibration
