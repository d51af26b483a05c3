#pragma once
// Short-time Fourier transform of one channel, sixteen frames side by side: the one spectrum that
// all spectral features of a window share.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "classifier/base/lanes.hpp"
#include "classifier/vibro/bin_tables.hpp"

namespace weft::classifier::vibro {

/// Size of a frame and from one frame to the next, as librosa 0.10 has them for a window of so many
/// samples: 2048 and 512, and of a shorter window the largest power of two that fits and a quarter
/// of it (S4). One sample makes a frame of two.
struct FrameSize {
  std::size_t length = 2048;
  std::size_t hop = 512;

  static FrameSize of(std::size_t samples);
  /// Frames of a window: centred, so one at every multiple of `hop`, the first at 0.
  [[nodiscard]] std::size_t count(std::size_t samples) const { return 1 + samples / hop; }
  /// Hops that one frame spans.
  [[nodiscard]] std::size_t hops() const { return length / hop; }
  friend bool operator==(const FrameSize&, const FrameSize&) = default;
};

/// What is added up over the bins of sixteen frames while their magnitudes are made.
struct BinSums {
  PerFrame magnitude{};
  PerFrame moment_hz{};                         ///< magnitude times frequency
  PerFrame loudest{};                           ///< the largest magnitude
  std::array<PerFrame, pitch_classes> power{};  ///< of every pitch class; 0 where not asked for
};

/// Hann windows of a periodic length, magnitudes of centred frames, zeros beyond both ends. A frame
/// is four hops, and so are the samples that a butterfly of a transform's first level takes: hops
/// stand side by side, sixteen frames begin in neighbouring ones, and no frame is copied.
class ShortTimeSpectrum {
 public:
  static constexpr std::size_t lanes = frame_lanes;

  explicit ShortTimeSpectrum(FrameSize size);

  [[nodiscard]] const FrameSize& size() const { return size_; }
  [[nodiscard]] std::size_t bins() const { return size_.length / 2 + 1; }

  /// A new window, at least one sample, all finite.
  void start(std::span<const double> samples);
  /// Frames first .. first + 15 of the window: [bins x 16] to `to`, lanes of frames that do not
  /// exist are zero. `tables` are those of this size; with `chroma` false no class is added up.
  BinSums magnitudes(std::size_t first, const BinTables& tables, bool chroma, double* to);

 private:
  FrameSize size_;
  std::vector<double> hann_;
  simd::AlignedDoubles twiddle_;
  std::vector<std::uint32_t> place_;
  std::vector<double> last_hops_;
  simd::AlignedDoubles by_hop_;  // [hop x columns_]: sample j of every hop, zeros before and behind
  std::size_t columns_ = 0, frames_ = 0, samples_ = 0;
  simd::AlignedDoubles elements_;  // of the transform
};

// What is read from the spectra of sixteen frames at once.

struct FrameFeatures {
  PerFrame centroid_hz{};   ///< mean frequency, weighted by the magnitude; 0 of a silent frame
  PerFrame bandwidth_hz{};  ///< deviation about it, weighted so; 0 of a silent frame
  PerFrame rolloff_hz{};    ///< lowest frequency with 85 % of the magnitudes at or below it
  PerFrame chroma{};        ///< mean over the classes of their power over the largest class's
  PerFrame decibels{};      ///< sum over the bins of 10 log10(max(power, least_power))
  std::array<bool, frame_lanes> silent{};  ///< not one magnitude above 0
};

/// `magnitudes` [bins x 16] with their `sums`, by the tables of which they were made;
/// `least_power` > 0. Decibels are products of mantissas and sums of exponents, so that hardly a
/// logarithm is taken.
FrameFeatures frame_features(const double* magnitudes, const BinSums& sums, const BinTables& tables,
                             double least_power);

}  // namespace weft::classifier::vibro
