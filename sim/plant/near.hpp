#pragma once
// e^x and (1 + e)^n near zero by short polynomials, exact to rounding: within a substep the cloth's
// exponentials change by little, and a product costs a tenth of a library call.

#include <array>
#include <cmath>
#include <cstddef>

namespace weft::sim {

/// c[0] + c[1] x + ... + c[7] x^7, in pairs that do not wait for each other (Estrin's scheme).
inline double polynomial_7(const std::array<double, 8>& c, double x) {
  const double x2 = x * x, x4 = x2 * x2;
  return ((c[0] + c[1] * x) + x2 * (c[2] + c[3] * x)) +
         x4 * ((c[4] + c[5] * x) + x2 * (c[6] + c[7] * x));
}

/// e^x.
inline double near_exp(double x) {
  if (!(std::abs(x) < 0.02)) return std::exp(x);
  // Taylor to x^7: what is left out is below 1e-18.
  constexpr std::array<double, 8> taylor{1,        1,         1.0 / 2,   1.0 / 6,
                                         1.0 / 24, 1.0 / 120, 1.0 / 720, 1.0 / 5040};
  return polynomial_7(taylor, x);
}

/// e^x, to a few units of the last place, four times as far from zero.
inline double nearby_exp(double x) {
  if (!(std::abs(x) < 0.08)) return std::exp(x);
  const double quarter = near_exp(0.25 * x), half = quarter * quarter;
  return half * half;
}

/// x^n for x > 0 and 0 <= n <= 2, from where it was last computed in full.
class NearPower {
 public:
  explicit NearPower(double exponent) : exponent_(exponent) {
    for (std::size_t k = 1; k < binomial_.size(); ++k) {
      const double i = static_cast<double>(k);
      binomial_[k] = binomial_[k - 1] * (exponent - i + 1) / i;
    }
  }

  /// (1 + e)^n for |e| < 0.01, without memory.
  [[nodiscard]] double of_change(double e) const { return polynomial_7(binomial_, e); }

  double operator()(double x) {
    const double e = (x - at_) * inverse_;
    if (!(std::abs(e) < 0.01)) return anchor(x);
    return value_ * polynomial_7(binomial_, e);  // what is left out is below 1e-17
  }

 private:
  double anchor(double x) {
    at_ = x;
    inverse_ = 1 / x;
    return value_ = std::pow(x, exponent_);
  }

  double exponent_;
  std::array<double, 8> binomial_{1};
  double at_ = 1, inverse_ = 1, value_ = 1;
};

}  // namespace weft::sim
