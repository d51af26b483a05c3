#pragma once
// Magnitudes of the discrete Fourier transform of real signals of any length, sixteen at a time or
// two.
//
// Bluestein's algorithm: the transform of length n becomes a convolution of a length that is easy,
// so that a prime n costs the same as its neighbours (a mixed-radix library is O(n p) in the
// largest prime factor p). Two real signals are one complex one; eight of those fill the lanes of a
// processor. A length that is a power of two is transformed as it is. Up to sixteen samples the
// sums are taken as they are written.

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
  /// Magnitudes per signal: bins 0 .. floor(length / 2).
  [[nodiscard]] std::size_t bins() const { return length_ / 2 + 1; }

  /// |DFT| of s real signals, each less its `offset` [s]: sixteen for V = simd::Lanes, two for V =
  /// double. `rows` [length x s], a sample of every signal per row; `largest` [s]: the largest
  /// magnitude of each less its offset. Returns [bins x s] in `scratch`, which grows to what is
  /// needed and may be shared between lengths. Signals share transforms in pairs; each is scaled by
  /// a power of two first, so a weak signal does not drown in the rounding of a strong one, and a
  /// silent one has exact zeros.
  template <class V>
  const double* magnitudes(const double* rows, const double* offset, const double* largest,
                           simd::AlignedDoubles& scratch) const;

 private:
  void transform_kernel();
  // Twiddles behind those of the first level.
  [[nodiscard]] const double* levels() const {
    return radix_ == 0 ? nullptr : twiddle_.data() + 2 * (radix_ - 1) * part_;
  }

  std::size_t length_;
  // The transform has radix x part >= 2 length - 1 elements; a part is a power of two. 1 and
  // `length` where that is a power of two itself: then `place_` says where each bin is left, and
  // there is neither chirp nor kernel. None of both, and roots of `length`, where the signals are
  // so short that terms are summed one by one.
  std::size_t radix_ = 0, part_ = 0;
  simd::AlignedDoubles twiddle_;
  std::vector<double> root_;     // cos and sin of 2 pi k / radix
  simd::AlignedDoubles chirp_;   // exp(-i pi j^2 / length)
  simd::AlignedDoubles kernel_;  // transform of the conjugate chirp / elements, in its own order
  std::vector<std::uint32_t> place_;
};

/// The tables of the lengths used last: motions of a campaign differ by a sample or two, and votes
/// while a slide goes on look at the same lengths again with every slide. Tables take some 90 bytes
/// a sample, so long motions leave room for fewer.
class SpectrumCache {
 public:
  /// As many as a live model has stages, with a few lengths beside them.
  static constexpr std::size_t most = 72;

  /// Valid until the next call.
  const Spectrum& of(std::size_t length);

 private:
  static constexpr std::size_t most_samples = std::size_t{1} << 20;  // of all, unless one has more

  void make_room(std::size_t length);

  std::vector<std::unique_ptr<Spectrum>> recent_;  // last used first
};

}  // namespace weft::classifier
