#include "classifier/vibro/learn/minimise.hpp"

#include <algorithm>
#include <cmath>
#include <deque>

namespace weft::classifier::vibro {
namespace {

using Vector = std::vector<double>;

double dot(const Vector& a, const Vector& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

// a + factor b
Vector plus(const Vector& a, double factor, const Vector& b) {
  Vector out(a);
  for (std::size_t i = 0; i < a.size(); ++i) out[i] += factor * b[i];
  return out;
}

struct Step {
  Vector moved, turned;  // of the place, of the slopes
  double curvature = 0.0;
};

// Minus the slopes times what the last steps tell of the inverse curvature.
Vector downhill(const Vector& slope, const std::deque<Step>& steps) {
  Vector out(slope);
  Vector factor;
  for (auto s = steps.rbegin(); s != steps.rend(); ++s) {
    factor.push_back(dot(s->moved, out) / s->curvature);
    out = plus(out, -factor.back(), s->turned);
  }
  if (!steps.empty()) {
    const double scale = steps.back().curvature / dot(steps.back().turned, steps.back().turned);
    for (double& v : out) v *= scale;
  }
  for (const Step& s : steps) {
    out = plus(out, factor.back() - dot(s.turned, out) / s.curvature, s.moved);
    factor.pop_back();
  }
  for (double& v : out) v = -v;
  return out;
}

double largest_magnitude(const Vector& v) {
  double out = 0.0;
  for (const double x : v) out = std::max(out, std::abs(x));
  return out;
}

}  // namespace

std::vector<double> minimum(const Slopes& function, std::vector<double> x,
                            const MinimumOptions& options) {
  constexpr std::size_t remembered = 10;
  constexpr double enough = 1e-4;  // of the fall that the slope promises
  constexpr int most_halvings = 50;
  Vector slope(x.size());
  double value = function(x, slope);
  std::deque<Step> steps;
  for (std::size_t i = 0; i < options.most_steps; ++i) {
    if (largest_magnitude(slope) <= options.largest_slope) break;
    const Vector direction = downhill(slope, steps);
    const double promised = dot(direction, slope);
    double length = steps.empty() ? std::min(1.0, 1.0 / largest_magnitude(slope)) : 1.0;
    Vector next, next_slope(x.size());
    double next_value = value;
    bool fell = false;
    for (int h = 0; h < most_halvings && !fell; ++h, length *= 0.5) {
      next = plus(x, length, direction);
      next_value = function(next, next_slope);
      fell = next_value <= value + enough * length * promised;
    }
    if (!fell) break;
    Step step{plus(next, -1.0, x), plus(next_slope, -1.0, slope)};
    step.curvature = dot(step.moved, step.turned);
    if (step.curvature > 0.0) steps.push_back(std::move(step));
    if (steps.size() > remembered) steps.pop_front();
    x = std::move(next);
    slope = std::move(next_slope);
    value = next_value;
  }
  return x;
}

}  // namespace weft::classifier::vibro
