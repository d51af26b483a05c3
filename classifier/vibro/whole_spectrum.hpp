#pragma once
// Mean amplitude of the spectrum of a whole window, whatever its length.

#include <memory>
#include <optional>
#include <span>

#include "classifier/features/spectrum.hpp"
#include "classifier/vibro/real_transform.hpp"

namespace weft::classifier::vibro {

/// Lengths whose prime factors are 2, 3 and 5, which windows of round durations have, go through
/// RealTransform, and where they are no multiple of sixteen through Eigen's mixed-radix transform;
/// that is slow for large primes, so others go through Bluestein's (Spectrum). Keeps its tables for
/// the last lengths.
class WholeSpectrum {
 public:
  WholeSpectrum();
  ~WholeSpectrum();
  WholeSpectrum(WholeSpectrum&&) noexcept;
  WholeSpectrum& operator=(WholeSpectrum&&) noexcept;

  /// Mean over the bins 1 .. n / 2 of 2 / n |DFT| of the samples less `mean`; 0 of one sample.
  double mean_amplitude(std::span<const double> samples, double mean);

 private:
  struct MixedRadix;  // keeps Eigen out of this header
  double by_lanes(std::span<const double> samples, double mean);
  double by_mixed_radix(std::span<const double> samples, double mean);
  double by_convolution(std::span<const double> samples, double mean);

  std::optional<RealTransform> round_;  // of the last such length
  std::unique_ptr<MixedRadix> mixed_radix_;
  SpectrumCache convolution_;
  simd::AlignedDoubles rows_, scratch_;
};

}  // namespace weft::classifier::vibro
