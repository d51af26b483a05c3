#pragma once
// e^x and (1 + e)^n near zero by short polynomials, exact to rounding. Within a substep the
// exponentials of a fabric change little, and a product costs a tenth of a library call. Also e^x
// in float.

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace weft::sim {

constexpr float fast_exp_limit = 87;  // e^87 and e^-87 are normal floats

/// e^x for |x| <= fast_exp_limit, undefined beyond. Without branches, so that loops over height
/// fields vectorise. Relative error below 2e-7. Method: x = n ln 2 + f, polynomial in f
/// (coefficients of Cephes expf, public domain), exponent n inserted by bits.
inline float fast_exp(float x) {
  constexpr float shifter = 12582912.0F;  // 1.5 * 2^23: adding it rounds to an integer
  const float shifted = x * 1.44269504F + shifter;
  const float n = shifted - shifter;
  const float f = (x - n * 0.693359375F) + n * 2.12194440e-4F;  // ln 2 in two parts
  float p = 1.9875691500e-4F;
  p = p * f + 1.3981999507e-3F;
  p = p * f + 8.3334519073e-3F;
  p = p * f + 4.1665795894e-2F;
  p = p * f + 1.6666665459e-1F;
  p = p * f + 5.0000001201e-1F;
  p = p * f * f + f + 1.0F;
  const std::uint32_t scale = (std::bit_cast<std::uint32_t>(shifted) + 127U) << 23;
  return p * std::bit_cast<float>(scale);
}

/// e^x in place, arguments clamped to the limit. Two loops, because g++ 12 vectorises them only
/// separately.
template <std::size_t count>
void fast_exp(float* x) {
  for (std::size_t i = 0; i < count; ++i) {
    const float above = x[i] > -fast_exp_limit ? x[i] : -fast_exp_limit;
    x[i] = above < fast_exp_limit ? above : fast_exp_limit;
  }
  for (std::size_t i = 0; i < count; ++i) x[i] = fast_exp(x[i]);
}

/// c[0] + c[1] x + ... + c[7] x^7, in independent pairs (Estrin's scheme).
inline double polynomial_7(const std::array<double, 8>& c, double x) {
  const double x2 = x * x, x4 = x2 * x2;
  return ((c[0] + c[1] * x) + x2 * (c[2] + c[3] * x)) +
         x4 * ((c[4] + c[5] * x) + x2 * (c[6] + c[7] * x));
}

inline double near_exp(double x) {
  if (!(std::abs(x) < 0.02)) return std::exp(x);
  // Taylor series to x^7; the truncation error is below 1e-18.
  constexpr std::array<double, 8> taylor{1,        1,         1.0 / 2,   1.0 / 6,
                                         1.0 / 24, 1.0 / 120, 1.0 / 720, 1.0 / 5040};
  return polynomial_7(taylor, x);
}

/// e^x with an error of a few units in the last place, for a four times wider range than
/// near_exp().
inline double nearby_exp(double x) {
  if (!(std::abs(x) < 0.08)) return std::exp(x);
  const double quarter = near_exp(0.25 * x), half = quarter * quarter;
  return half * half;
}

/// x^n for x > 0 and 0 <= n <= 2, from the last x with a full computation.
class NearPower {
 public:
  explicit NearPower(double exponent) : exponent_(exponent) {
    for (std::size_t k = 1; k < binomial_.size(); ++k) {
      const double i = static_cast<double>(k);
      binomial_[k] = binomial_[k - 1] * (exponent - i + 1) / i;
    }
  }

  /// (1 + e)^n for |e| < 0.01, independent of earlier calls.
  [[nodiscard]] double of_change(double e) const { return polynomial_7(binomial_, e); }

  double operator()(double x) {
    const double e = (x - at_) * inverse_;
    if (!(std::abs(e) < 0.01)) return anchor(x);
    return value_ * polynomial_7(binomial_, e);  // the truncation error is below 1e-17
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
