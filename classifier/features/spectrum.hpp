#pragma once
// Magnitudes of the discrete Fourier transform of real signals of any length, sixteen at a time.
//
// Bluestein's algorithm: the transform of length n becomes a convolution of a power-of-two length,
// so that a prime n costs the same as its neighbours (a mixed-radix library is O(n p) in the
// largest prime factor p). Sixteen real signals are eight complex ones, which fill the lanes of a
// processor.

#include <cstddef>
#include <memory>
#include <vector>

#include "classifier/features/lanes.hpp"

namespace weft::classifier {

/// Tables for one signal length.
class Spectrum {
 public:
  static constexpr std::size_t signals = simd::block_taxels;

  /// length >= 1
  explicit Spectrum(std::size_t length);

  [[nodiscard]] std::size_t length() const { return length_; }
  /// Magnitudes per signal: bins 0 .. floor(length / 2).
  [[nodiscard]] std::size_t bins() const { return length_ / 2 + 1; }

  /// |DFT| of sixteen real signals, each less its `offset` [16]. `rows` [length x 16], a sample of
  /// every signal per row; `out` [bins x 16]. Signals share transforms in pairs; each is scaled by
  /// a power of two first, so a weak signal does not drown in the rounding of a strong one, and a
  /// silent one has exact zeros. `scratch` grows to what is needed and may be shared between
  /// lengths.
  void magnitudes(const double* rows, const double* offset, simd::AlignedDoubles& scratch,
                  double* out) const;

 private:
  std::size_t length_;
  std::size_t padded_;           // power of two >= 2 length - 1
  std::vector<double> twiddle_;  // w^j, w^2j, w^3j of every level, largest first
  std::vector<double> chirp_;    // exp(-i pi j^2 / length)
  simd::AlignedDoubles kernel_;  // transform of the conjugate chirp / padded, in its own order
};

/// The tables of the lengths used last: motions of a campaign differ by a sample or two.
class SpectrumCache {
 public:
  /// Valid until the next call.
  const Spectrum& of(std::size_t length);

 private:
  static constexpr std::size_t most = 8;
  std::vector<std::unique_ptr<Spectrum>> recent_;  // last used first
};

}  // namespace weft::classifier
