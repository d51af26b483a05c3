#pragma once
// Magnitudes of the discrete Fourier transform of real signals of any length.
//
// Bluestein's algorithm: the transform of length n becomes a convolution of a power-of-two length,
// so that a prime n costs the same as its neighbours (a mixed-radix library is O(n p) in the
// largest prime factor p).

#include <cstddef>
#include <span>
#include <vector>

namespace weft::classifier {

/// Tables and scratch for one signal length. Not for use by two threads at once.
class Spectrum {
 public:
  explicit Spectrum(std::size_t length);

  [[nodiscard]] std::size_t length() const { return length_; }
  /// Magnitudes per signal: bins 0 .. floor(length / 2).
  [[nodiscard]] std::size_t bins() const { return length_ / 2 + 1; }

  /// |DFT| of two real signals through one complex transform. Each is scaled by a power of two
  /// first, so a weak signal does not drown in the rounding of a strong one.
  void magnitudes(std::span<const double> a, std::span<const double> b, std::span<double> out_a,
                  std::span<double> out_b);

 private:
  void transform();
  void forward(std::vector<double>& re, std::vector<double>& im) const;
  void inverse(std::vector<double>& re, std::vector<double>& im) const;

  std::size_t length_;
  std::size_t padded_;                           // power of two >= 2 length - 1
  std::vector<double> twiddle_re_, twiddle_im_;  // all stages, longest first
  std::vector<double> chirp_re_, chirp_im_;      // exp(-i pi j^2 / length)
  std::vector<double> kernel_re_, kernel_im_;    // transform of the conjugate chirp / padded
  std::vector<double> work_re_, work_im_;
};

}  // namespace weft::classifier
