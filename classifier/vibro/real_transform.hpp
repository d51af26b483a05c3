#pragma once
// Magnitudes of the discrete Fourier transform of one long real signal of round length.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/base/lanes.hpp"

namespace weft::classifier::vibro {

/// Transposes: v[i][k] and v[k][i] change places.
WEFT_INLINE void transpose(simd::Lanes* v) {
  using simd::Lanes;
  Lanes pairs[simd::width], fours[simd::width];
  for (std::size_t i = 0; i < simd::width; i += 2) {
    pairs[i] = __builtin_shufflevector(v[i], v[i + 1], 0, 8, 2, 10, 4, 12, 6, 14);
    pairs[i + 1] = __builtin_shufflevector(v[i], v[i + 1], 1, 9, 3, 11, 5, 13, 7, 15);
  }
  for (std::size_t i = 0; i < simd::width; i += 4) {
    for (std::size_t k = 0; k < 2; ++k) {
      const Lanes low = pairs[i + k], high = pairs[i + k + 2];
      fours[i + k] = __builtin_shufflevector(low, high, 0, 1, 8, 9, 4, 5, 12, 13);
      fours[i + k + 2] = __builtin_shufflevector(low, high, 2, 3, 10, 11, 6, 7, 14, 15);
    }
  }
  for (std::size_t i = 0; i < simd::width / 2; ++i) {
    const Lanes low = fours[i], high = fours[i + 4];
    v[i] = __builtin_shufflevector(low, high, 0, 1, 2, 3, 8, 9, 10, 11);
    v[i + 4] = __builtin_shufflevector(low, high, 4, 5, 6, 7, 12, 13, 14, 15);
  }
}

/// Tables for one length, 16 m. Pairs of samples are a complex signal of half the length. Every
/// eighth element is in its own lane, so eight transforms of m elements run side by side, by levels
/// of 4, 2, 3 and 5, in order (Stockham). A butterfly of eight joins the lanes. The parts of even
/// and odd samples are separated at the end.
class RealTransform {
 public:
  /// True if the length is 16 m and m has no prime factors except 2, 3 and 5.
  static bool fits(std::size_t length);
  /// Requires fits(length).
  explicit RealTransform(std::size_t length);

  [[nodiscard]] std::size_t length() const { return 16 * elements_; }
  /// Sum over the bins 1 .. length / 2 of |DFT| of the samples less `mean`; needs `length` samples.
  double sum_of_magnitudes(std::span<const double> samples, double mean);

 private:
  struct Level {
    std::size_t radix = 0, part = 0, stride = 0;  // part: elements of an output's share
    std::vector<double> root, twiddle;
  };

  std::size_t elements_;  // m
  std::vector<Level> levels_;
  simd::AlignedDoubles
      between_;  // [m x 16]: factors of lane l of bin k before the lanes are joined
  simd::AlignedDoubles
      apart_;  // four segments of [m, padded] twice: factors that separate odd from even
  simd::AlignedDoubles from_, to_;
};

}  // namespace weft::classifier::vibro
