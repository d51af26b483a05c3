#include "classifier/base/student_t.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

namespace weft::classifier {
namespace {

// log of Gamma(a + 1/2) / Gamma(a), without the cancellation of two lgamma. Recurrence up to a >=
// 30, then the asymptotic series (Tricomi and Erdelyi 1951); there its next term is below 1e-16.
double log_gamma_ratio(double a) {
  constexpr std::array series = {1.0,
                                 -1.0 / 8,
                                 1.0 / 128,
                                 5.0 / 1024,
                                 -21.0 / 32768,
                                 -399.0 / 262144,
                                 869.0 / 4194304,
                                 39325.0 / 33554432,
                                 -334477.0 / 2147483648.0};
  double shift = 1.0;
  for (; a < 30.0; a += 1.0) shift *= a / (a + 0.5);
  double sum = 0.0;
  for (auto c = series.rbegin(); c != series.rend(); ++c) sum = sum / a + *c;
  return 0.5 * std::log(a) + std::log(sum * shift);
}

// log of the front factor x^a (1-x)^b / (a B(a,b)) of I_x(a, b), for {a, b} = {df/2, 1/2} in either
// order. log B(df/2, 1/2) = log sqrt(pi) - log_gamma_ratio(df/2).
double log_front(double log_x, double log_1mx, double a, double b, double half_df) {
  const double log_beta = 0.5 * std::log(std::numbers::pi) - log_gamma_ratio(half_df);
  return a * log_x + b * log_1mx - std::log(a) - log_beta;
}

// Continued fraction of I_x(a, b) by Lentz's method (DLMF 8.17.22); converges for x < (a + 1) / (a
// + b + 2).
double continued_fraction(double x, double a, double b) {
  constexpr double tiny = 1e-300;
  constexpr int most_terms = 100000;
  const auto away_from_zero = [](double v) { return std::abs(v) < tiny ? tiny : v; };
  double c = 1.0;
  double d = 1.0 / away_from_zero(1.0 - (a + b) * x / (a + 1.0));
  double h = d;
  for (int m = 1; m < most_terms; ++m) {
    const double k = m;
    const double even = k * (b - k) * x / ((a + 2 * k - 1) * (a + 2 * k));
    d = 1.0 / away_from_zero(1.0 + even * d);
    c = away_from_zero(1.0 + even / c);
    h *= d * c;
    const double odd = -(a + k) * (a + b + k) * x / ((a + 2 * k) * (a + 2 * k + 1));
    d = 1.0 / away_from_zero(1.0 + odd * d);
    c = away_from_zero(1.0 + odd / c);
    const double step = d * c;
    h *= step;
    if (std::abs(step - 1.0) < std::numeric_limits<double>::epsilon()) break;
  }
  return h;
}

}  // namespace

double log_two_sided_p(double t, double df) {
  if (std::isnan(t) || !(df > 0.0)) return std::numeric_limits<double>::quiet_NaN();
  const double size = std::abs(t);
  if (size == 0.0) return 0.0;
  if (std::isinf(size)) return -std::numeric_limits<double>::infinity();
  const double a = df / 2.0;
  // t^2 may overflow; its logarithm does not. log x = -log(1 + t^2/df), log(1-x) = log x +
  // log(t^2/df).
  const double log_ratio = 2.0 * std::log(size) - std::log(df);
  const double ratio = size / df * size;
  const double log_x = std::isfinite(ratio) ? -std::log1p(ratio) : -log_ratio;
  const double x = std::exp(log_x);
  const double log_1mx = -std::log1p(1.0 / ratio);
  if (x < (a + 1.0) / (a + 2.5)) {
    return log_front(log_x, log_1mx, a, 0.5, a) + std::log(continued_fraction(x, a, 0.5));
  }
  const double complement = std::exp(log_front(log_1mx, log_x, 0.5, a, a)) *
                            continued_fraction(ratio / (1.0 + ratio), 0.5, a);
  return std::log1p(-std::min(complement, 1.0));
}

double two_sided_p(double t, double df) {
  return std::exp(log_two_sided_p(t, df));
}

double critical_t(double p, double df) {
  if (!(p > 0.0 && p < 1.0 && df > 0.0)) return std::numeric_limits<double>::quiet_NaN();
  const double wanted = std::log(p);
  double low = 0.0, high = 1.0;
  while (std::isfinite(high) && log_two_sided_p(high, df) > wanted) {
    low = high;
    high *= 2.0;
  }
  if (!std::isfinite(high)) return high;
  // Halves the bracket until no double lies inside.
  for (double t = std::midpoint(low, high); t > low && t < high; t = std::midpoint(low, high))
    (log_two_sided_p(t, df) > wanted ? low : high) = t;
  return high;
}

double RareT::critical(double delta, double df) const {
  const std::lock_guard lock(mutex_);
  const auto [at, is_new] = known_.try_emplace({delta, df}, 0.0);
  if (is_new) at->second = critical_t(delta, df);
  return at->second;
}

RareT::Limit RareT::limit(double delta, double df) const {
  return {critical(delta, df), delta, df};
}

bool RareT::Limit::passed_by(double t) const {
  constexpr double margin = 1e-9;  // far larger than the errors of p and critical_t
  if (std::abs(t) > critical * (1.0 + margin)) return true;
  if (std::abs(t) < critical * (1.0 - margin)) return false;
  return two_sided_p(t, df) < delta;
}

}  // namespace weft::classifier
