#pragma once
// The ten figures of one channel of one window, the mean amplitude of its whole spectrum, and its
// power in sixteen bands of frequency.

#include <array>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "classifier/features/spectrum.hpp"
#include "classifier/vibro/level_features.hpp"
#include "classifier/vibro/real_transform.hpp"
#include "classifier/vibro/short_time.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier::vibro {

/// Spectrum of a whole window of any length. Windows of round durations have lengths with prime
/// factors 2, 3 and 5. These use RealTransform if they are multiples of sixteen, else Eigen's
/// mixed-radix transform. That is slow for large primes, so other lengths use Bluestein's algorithm
/// (Spectrum). Keeps its tables for the last lengths.
class WholeSpectrum {
 public:
  WholeSpectrum();
  ~WholeSpectrum();
  WholeSpectrum(WholeSpectrum&&) noexcept;
  WholeSpectrum& operator=(WholeSpectrum&&) noexcept;

  /// Mean over the bins 1 .. n / 2 of 2 / n |DFT| of the samples less `mean`; 0 for one sample.
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

// Power in bands of frequency. Not from the paper: our own, for recordings that its figures
// describe too poorly.

inline constexpr std::size_t band_count = 16;
/// First the mean over the frames of each band's power in dB, then the deviation of each band.
using BandFeatures = std::array<double, 2 * band_count>;

/// First bin of every band, and the one after the last. Bands start at bin 2. Each is wider than
/// the one below by a constant ratio that gives sixteen, and at least one bin wide. Bands beyond
/// the last bin are empty.
std::array<std::size_t, band_count + 1> band_edges(std::size_t bins);

/// Sums over the frames of a window, sixteen at a time.
class BandSums {
 public:
  explicit BandSums(std::size_t bins) : edges_(band_edges(bins)) {}
  /// `magnitudes` [bins x 16]; only the first `frames` columns are frames.
  void add(const double* magnitudes, std::size_t frames);
  /// Needs at least one frame. An empty band has the least power, -100 dB.
  [[nodiscard]] BandFeatures figures() const;

 private:
  std::array<std::size_t, band_count + 1> edges_;
  std::array<std::vector<double>, band_count> level_db_;  // per frame
};

/// "Texture Classification Based on Sound and Vibro-Tactile Data" (2023), section 2.3.2.
enum class FrameFeature {
  mean,
  std,         ///< deviation, biased
  mad,         ///< median absolute deviation from the median, not scaled (S2)
  rmse,        ///< mean over the frames of their root mean square
  chroma,      ///< mean over frames and pitch classes of the power relative to the loudest class
  centroid,    ///< mean over the frames that are not silent [Hz]
  bandwidth,   ///< like the centroid [Hz]
  rolloff,     ///< mean over all frames, 0 for a silent one [Hz]
  perceptual,  ///< mean over frames and bins of A-weighted power in dB, 80 dB deep (S3)
  zcr,         ///< mean over the frames of sign changes per sample
};
inline constexpr std::size_t figure_count = 10;
static_assert(static_cast<std::size_t>(FrameFeature::zcr) == figure_count - 1);
using ChannelFeatures = std::array<double, figure_count>;

/// "MEAN", "STD" ... "ZCR", in the order of the enumeration.
std::string_view to_string(FrameFeature figure);

/// Computes the figures of windows of one rate, with one short-time spectrum for all of them. Keeps
/// its tables for all window lengths so far. Thread: one at a time.
class ChannelExtractor {
 public:
  /// Longest window: 131 s at 8 kHz. The spectra of all its frames stay in memory, 17 MB.
  static constexpr std::size_t most_samples = std::size_t{1} << 20;

  /// 0 < rate_hz
  explicit ChannelExtractor(double rate_hz) : rate_hz_(rate_hz) {}

  /// Figures of the samples of one window by librosa's definitions (0.10, zeros beyond the ends).
  /// Without `chroma` CHROMA is 0, which saves a twelfth of the time. `bands`, if given, is filled
  /// from the same spectrum. Refuses no samples, too many, a non-finite sample (with its index),
  /// and samples so large that a figure is not finite.
  Result<ChannelFeatures> figures(std::span<const double> samples, bool chroma = true,
                                  BandFeatures* bands = nullptr);
  /// Mean one-sided amplitude of the window's transform, mean removed, without DC (S6); 0 for one
  /// sample. Refuses the same as figures().
  Result<double> mean_amplitude(std::span<const double> samples);

 private:
  struct Tools {
    Tools(double rate_hz, FrameSize size) : frames(size), bins(rate_hz, size.length) {}
    ShortTimeSpectrum frames;
    BinTables bins;
  };

  Tools& tools_for(FrameSize size);
  void moments(std::span<const double> samples, ChannelFeatures& out);
  double transform(std::span<const double> samples, Tools& tools, bool chroma, BandFeatures* bands);
  void spectral(std::span<const double> samples, bool chroma, ChannelFeatures& out,
                BandFeatures* bands);

  double rate_hz_;
  std::map<std::size_t, Tools> tools_;  // by frame length
  MedianFinder median_;
  WholeSpectrum whole_;
  std::vector<double> deviation_, hop_squares_;
  std::vector<std::size_t> hop_crossings_;
  simd::AlignedDoubles spectra_;  // of all blocks of frames
  std::vector<BinSums> sums_;     // of all blocks of frames
};

}  // namespace weft::classifier::vibro
