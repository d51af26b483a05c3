#pragma once
// e^x and (1 + e)^n near zero by short polynomials, exact to rounding: within a substep the cloth's
// exponentials change by little, and a product costs a tenth of a library call.

#include <cmath>

namespace weft::sim {

/// e^x.
inline double near_exp(double x) {
  if (!(std::abs(x) < 0.02)) return std::exp(x);
  // Taylor to x^7: what is left out is below 1e-18.
  return 1 + x * (1 + x * (1.0 / 2 +
                           x * (1.0 / 6 +
                                x * (1.0 / 24 + x * (1.0 / 120 + x * (1.0 / 720 + x / 5040))))));
}

/// x^n for x > 0 and 0 <= n <= 2, from where it was last computed in full.
class NearPower {
 public:
  explicit NearPower(double exponent) : n_(exponent) {}

  double operator()(double x) {
    const double e = (x - at_) * inverse_;
    if (!(std::abs(e) < 0.01)) return anchor(x);
    // Binomial series to e^7: what is left out is below 1e-17.
    double sum = 1;
    for (int k = 7; k > 0; --k) sum = 1 + sum * e * (n_ - (k - 1)) * reciprocal[k];
    return value_ * sum;
  }

 private:
  static constexpr double reciprocal[] = {0,       1,       1.0 / 2, 1.0 / 3,
                                          1.0 / 4, 1.0 / 5, 1.0 / 6, 1.0 / 7};
  double anchor(double x) {
    at_ = x;
    inverse_ = 1 / x;
    return value_ = std::pow(x, n_);
  }

  double n_;
  double at_ = 1, inverse_ = 1, value_ = 1;
};

}  // namespace weft::sim
