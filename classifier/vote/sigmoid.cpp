#include "classifier/vote/sigmoid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace weft::classifier {
namespace {

// Lin, Lin and Weng 2007, appendix: Newton's method with backtracking.
constexpr int most_steps = 100;
constexpr double least_step = 1e-10;
constexpr double ridge = 1e-12;       // keeps the Hessian positive definite
constexpr double gradient_ok = 1e-9;  // of a sum over decision values scaled to at most 1

struct Problem {
  std::vector<double> f;       // scaled to at most 1
  std::vector<double> target;  // Platt's
};

// -log likelihood, written so that exp() never overflows (section 3 of the paper).
double cost(const Problem& problem, const Sigmoid& s) {
  double sum = 0.0;
  for (std::size_t i = 0; i < problem.f.size(); ++i) {
    const double x = s.slope * problem.f[i] + s.offset;
    const double t = x >= 0.0 ? problem.target[i] : problem.target[i] - 1.0;
    sum += t * x + std::log1p(std::exp(-std::abs(x)));
  }
  return sum;
}

struct Derivatives {
  double slope = 0.0, offset = 0.0;                     // gradient
  double slope2 = ridge, mixed = 0.0, offset2 = ridge;  // Hessian
};

Derivatives derivatives(const Problem& problem, const Sigmoid& s) {
  Derivatives out;
  for (std::size_t i = 0; i < problem.f.size(); ++i) {
    const double f = problem.f[i];
    const double p = s(f);
    const double d1 = problem.target[i] - p;
    const double d2 = p * (1.0 - p);
    out.slope += f * d1;
    out.offset += d1;
    out.slope2 += f * f * d2;
    out.mixed += f * d2;
    out.offset2 += d2;
  }
  return out;
}

// One Newton step; false when there is nothing left to gain.
bool improve(const Problem& problem, Sigmoid& s, double& at) {
  const Derivatives d = derivatives(problem, s);
  if (std::abs(d.slope) < gradient_ok && std::abs(d.offset) < gradient_ok) return false;
  const double det = d.slope2 * d.offset2 - d.mixed * d.mixed;
  const double slope = -(d.offset2 * d.slope - d.mixed * d.offset) / det;
  const double offset = -(d.slope2 * d.offset - d.mixed * d.slope) / det;
  const double fall = d.slope * slope + d.offset * offset;
  if (!std::isfinite(slope) || !std::isfinite(offset)) return false;
  for (double step = 1.0; step >= least_step; step *= 0.5) {
    const Sigmoid next{s.slope + step * slope, s.offset + step * offset};
    const double there = cost(problem, next);
    if (!(there < at + 1e-4 * step * fall)) continue;
    s = next;
    at = there;
    return true;
  }
  return false;
}

}  // namespace

double Sigmoid::operator()(double f) const {
  const double x = slope * f + offset;
  return x >= 0.0 ? std::exp(-x) / (1.0 + std::exp(-x)) : 1.0 / (1.0 + std::exp(x));
}

Sigmoid fit_sigmoid(std::span<const double> f, std::span<const int> sign) {
  double top = 0.0, positive = 0.0, negative = 0.0;
  for (std::size_t i = 0; i < f.size(); ++i) {
    top = std::max(top, std::abs(f[i]));
    (sign[i] > 0 ? positive : negative) += 1.0;
  }
  const double high = (positive + 1.0) / (positive + 2.0), low = 1.0 / (negative + 2.0);
  const double mean = (positive * high + negative * low) / std::max(1.0, positive + negative);
  const Sigmoid flat{0.0, f.empty() ? 0.0 : std::log((1.0 - mean) / mean)};
  if (!(top > std::numeric_limits<double>::min())) return flat;
  Problem problem;
  for (std::size_t i = 0; i < f.size(); ++i) {
    problem.f.push_back(f[i] / top);
    problem.target.push_back(sign[i] > 0 ? high : low);
  }
  Sigmoid out = flat;
  double at = cost(problem, out);
  for (int step = 0; step < most_steps && improve(problem, out, at); ++step) continue;
  out.slope /= top;
  return out.slope < 0.0 && std::isfinite(out.slope) ? out : flat;
}

}  // namespace weft::classifier
