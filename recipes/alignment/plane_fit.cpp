#include "recipes/alignment/plane_fit.hpp"

#include <algorithm>
#include <cmath>

namespace weft::recipes {
namespace {

/// Points count as a line when their width is below this share of their length.
constexpr double least_width_share = 1e-3;

/// Second moments of the points about their mean.
struct Moments {
  double xx = 0, xy = 0, yy = 0, xh = 0, yh = 0;

  [[nodiscard]] double determinant() const { return xx * yy - xy * xy; }
  /// Squared ratio of the extent across to the extent along.
  [[nodiscard]] double width_share() const {
    const double half_sum = 0.5 * (xx + yy);
    const double greatest = half_sum + std::hypot(0.5 * (xx - yy), xy);
    return greatest > 0 ? determinant() / (greatest * greatest) : 0;
  }
};

bool usable(const TouchPoint& p) {
  return std::isfinite(p.contact_m.x_m) && std::isfinite(p.contact_m.y_m) &&
         std::isfinite(p.height_m);
}

PlaneFit compute_mean(std::span<const TouchPoint> points) {
  PlaneFit fit;
  fit.points = points.size();
  const double share = 1 / static_cast<double>(points.size());
  for (const TouchPoint& p : points) {
    fit.centre_m.x_m += share * p.contact_m.x_m;
    fit.centre_m.y_m += share * p.contact_m.y_m;
    fit.height_m += share * p.height_m;
  }
  return fit;
}

Moments moments_about(const PlaneFit& mean, std::span<const TouchPoint> points) {
  Moments m;
  for (const TouchPoint& p : points) {
    const double x = p.contact_m.x_m - mean.centre_m.x_m;
    const double y = p.contact_m.y_m - mean.centre_m.y_m;
    const double h = p.height_m - mean.height_m;
    m.xx += x * x;
    m.xy += x * y;
    m.yy += y * y;
    m.xh += x * h;
    m.yh += y * h;
  }
  return m;
}

/// Computes the residuals of the fitted plane and, from them, the deviations of the slopes.
void check_fit(PlaneFit& fit, std::span<const TouchPoint> points, const Moments& m,
               double resolution_m) {
  double sum = 0;
  for (const TouchPoint& p : points) {
    const double residual = p.height_m - fit.height_at(p.contact_m);
    fit.residual_worst_m = std::max(fit.residual_worst_m, std::abs(residual));
    sum += residual * residual;
  }
  if (points.size() > 3)
    fit.residual_rms_m = std::sqrt(sum / static_cast<double>(points.size() - 3));
  const double touch_sd = std::max(fit.residual_rms_m, resolution_m / std::sqrt(12.0));
  fit.slope_x_sd = touch_sd * std::sqrt(m.yy / m.determinant());
  fit.slope_y_sd = touch_sd * std::sqrt(m.xx / m.determinant());
}

}  // namespace

Result<PlaneFit> fit_plane(std::span<const TouchPoint> points, double resolution_m) {
  if (points.size() < 3)
    return fail({.code = Errc::invalid_argument,
                 .where = "alignment",
                 .what = "too few touches for a plane",
                 .expected = "at least 3",
                 .got = std::to_string(points.size())});
  if (!std::ranges::all_of(points, usable) || !(resolution_m >= 0) || !std::isfinite(resolution_m))
    return fail({.code = Errc::invalid_argument,
                 .where = "alignment",
                 .what = "position of a touch not finite",
                 .expected = "finite positions"});
  PlaneFit fit = compute_mean(points);
  const Moments m = moments_about(fit, points);
  if (!(m.width_share() > least_width_share * least_width_share) || !std::isfinite(m.xx + m.yy))
    return fail({.code = Errc::invalid_argument,
                 .where = "alignment",
                 .what = "touches lie on one line",
                 .expected = "points that span a plane"});
  fit.slope_x = (m.xh * m.yy - m.yh * m.xy) / m.determinant();
  fit.slope_y = (m.yh * m.xx - m.xh * m.xy) / m.determinant();
  check_fit(fit, points, m, resolution_m);
  return fit;
}

}  // namespace weft::recipes
