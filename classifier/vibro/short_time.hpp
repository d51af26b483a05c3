#pragma once
// Short-time Fourier transform of one channel, sixteen frames side by side. All spectral features
// of a window share this spectrum.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "classifier/base/lanes.hpp"
#include "classifier/vibro/bin_tables.hpp"

namespace weft::classifier::vibro {

/// Length of a frame and distance of frames, as in librosa 0.10 for a window of `samples` samples:
/// 2048 and 512. For a shorter window it is the largest power of two that fits and a quarter of it
/// (S4). One sample makes a frame of two.
struct FrameSize {
  std::size_t length = 2048;
  std::size_t hop = 512;

  static FrameSize of(std::size_t samples);
  /// Number of frames of a window. They are centred: one at every multiple of `hop`, the first at
  /// 0.
  [[nodiscard]] std::size_t count(std::size_t samples) const { return 1 + samples / hop; }
  /// Hops that one frame spans.
  [[nodiscard]] std::size_t hops() const { return length / hop; }
  friend bool operator==(const FrameSize&, const FrameSize&) = default;
};

/// Sums over the bins of sixteen frames, computed with their magnitudes.
struct BinSums {
  PerFrame magnitude{};
  PerFrame moment_hz{};                         ///< magnitude times frequency
  PerFrame loudest{};                           ///< the largest magnitude
  std::array<PerFrame, pitch_classes> power{};  ///< of every pitch class; 0 if not requested
};

/// Hann windows of a periodic length, magnitudes of centred frames, zeros beyond both ends. A frame
/// is four hops, and a butterfly of a transform's first level takes one sample of each. Hops are
/// stored side by side and sixteen frames begin in neighbouring ones, so no frame is copied.
class ShortTimeSpectrum {
 public:
  static constexpr std::size_t lanes = frame_lanes;

  explicit ShortTimeSpectrum(FrameSize size);

  [[nodiscard]] const FrameSize& size() const { return size_; }
  [[nodiscard]] std::size_t bins() const { return size_.length / 2 + 1; }

  /// Starts a new window: at least one sample, all finite.
  void start(std::span<const double> samples);
  /// Frames first .. first + 15 of the window to `to` [bins x 16]; lanes without a frame are zero.
  /// `tables` are those of this size. Without `chroma` no class is summed.
  BinSums magnitudes(std::size_t first, const BinTables& tables, bool chroma, double* to);

 private:
  FrameSize size_;
  std::vector<double> hann_;
  simd::AlignedDoubles twiddle_;
  std::vector<std::uint32_t> place_;
  std::vector<double> last_hops_;
  simd::AlignedDoubles by_hop_;  // [hop x columns_]: sample j of every hop, zeros before and after
  std::size_t columns_ = 0, frames_ = 0, samples_ = 0;
  simd::AlignedDoubles elements_;  // of the transform
};

// Features from the spectra of sixteen frames at once.

struct FrameFeatures {
  PerFrame centroid_hz{};   ///< mean frequency, weighted by the magnitude; 0 for a silent frame
  PerFrame bandwidth_hz{};  ///< weighted deviation from it; 0 for a silent frame
  PerFrame rolloff_hz{};    ///< lowest frequency with 85 % of the magnitudes at or below it
  PerFrame chroma{};        ///< mean over the classes of their power relative to the largest class
  PerFrame decibels{};      ///< sum over the bins of 10 log10(max(power, least_power))
  std::array<bool, frame_lanes> silent{};  ///< no magnitude is above 0
};

/// `magnitudes` [bins x 16] with their `sums`, both made with `tables`; `least_power` > 0. Decibels
/// come from products of mantissas and sums of exponents, which needs few logarithms.
FrameFeatures frame_features(const double* magnitudes, const BinSums& sums, const BinTables& tables,
                             double least_power);

}  // namespace weft::classifier::vibro
