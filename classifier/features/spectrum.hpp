#pragma once
// Magnitudes of the discrete Fourier transform of real signals of any length, sixteen at a time or
// two.
//
// Bluestein's algorithm turns the transform of length n into a convolution of a convenient length.
// So a prime n costs the same as its neighbours (a mixed-radix library is O(n p) in the largest
// prime factor p). Two real signals are one complex one; eight of those fill the lanes of a
// processor. A length that is a power of two is transformed directly. Up to sixteen samples the
// sums are computed term by term.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "classifier/base/lanes.hpp"

namespace weft::classifier {

/// Tables for one signal length.
class Spectrum {
 public:
  static constexpr std::size_t most_signals = simd::block_taxels;

  /// length >= 1
  explicit Spectrum(std::size_t length);

  [[nodiscard]] std::size_t length() const { return length_; }
  /// Number of magnitudes per signal: bins 0 .. floor(length / 2).
  [[nodiscard]] std::size_t bins() const { return length_ / 2 + 1; }

  /// |DFT| of s real signals, each less its `offset` [s]: sixteen for V = simd::Lanes, two for V =
  /// double. `rows` [length x s], a sample of every signal per row. `largest` [s]: the largest
  /// magnitude of each less its offset. Returns [bins x s] in `scratch`, which grows as needed and
  /// may be shared between lengths. Pairs of signals share a transform. Each is scaled by a power
  /// of two first, so the rounding of a strong signal does not hide a weak one, and a silent one
  /// has exact zeros.
  template <class V>
  const double* magnitudes(const double* rows, const double* offset, const double* largest,
                           simd::AlignedDoubles& scratch) const;

 private:
  void transform_kernel();
  // Twiddles after those of the first level.
  [[nodiscard]] const double* levels() const {
    return radix_ == 0 ? nullptr : twiddle_.data() + 2 * (radix_ - 1) * part_;
  }

  std::size_t length_;
  // The transform has radix x part >= 2 length - 1 elements; a part is a power of two. If `length`
  // is a power of two, radix is 1 and part is `length`. Then `place_` has the position of each bin,
  // and there is neither chirp nor kernel. For very short signals the terms are summed one by one:
  // both are 0, and the roots are of `length`.
  std::size_t radix_ = 0, part_ = 0;
  simd::AlignedDoubles twiddle_;
  std::vector<double> root_;     // cos and sin of 2 pi k / radix
  simd::AlignedDoubles chirp_;   // exp(-i pi j^2 / length)
  simd::AlignedDoubles kernel_;  // transform of the conjugate chirp / elements, in its own order
  std::vector<std::uint32_t> place_;
};

/// The tables of the lengths used last. Motions of a campaign differ by a sample or two, and live
/// votes use the same lengths in every stroke. Tables take some 90 bytes a sample; therefore long
/// motions leave room for fewer.
class SpectrumCache {
 public:
  /// Room for the stages of a live model and a few more lengths.
  static constexpr std::size_t most = 72;

  /// The tables for `length`. Valid until the next call.
  const Spectrum& of(std::size_t length);

 private:
  static constexpr std::size_t most_samples = std::size_t{1}
                                              << 20;  // for all tables, unless one has more

  void make_room(std::size_t length);

  std::vector<std::unique_ptr<Spectrum>> recent_;  // most recently used first
};

}  // namespace weft::classifier
