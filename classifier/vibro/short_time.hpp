#pragma once
// Short-time Fourier transform of one channel, sixteen frames side by side: the one spectrum that
// all spectral features of a window share.

#include <cstddef>
#include <span>
#include <vector>

#include "classifier/features/lanes.hpp"
#include "classifier/features/spectrum.hpp"

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

/// Hann windows of a periodic length, magnitudes of centred frames, zeros beyond both ends.
class ShortTimeSpectrum {
 public:
  static constexpr std::size_t lanes = Spectrum::most_signals;

  explicit ShortTimeSpectrum(FrameSize size);

  [[nodiscard]] const FrameSize& size() const { return size_; }
  [[nodiscard]] std::size_t bins() const { return spectrum_.bins(); }

  /// A new window, at least one sample, all finite.
  void start(std::span<const double> samples);
  /// Frames first .. first + 15 of the window: [bins x 16], lanes of frames that do not exist are
  /// zero. Valid until the next call.
  const double* magnitudes(std::size_t first);

 private:
  FrameSize size_;
  Spectrum spectrum_;
  std::vector<double> hann_;
  std::vector<double> padded_;  // half a frame of zeros, the samples, zeros for a block of frames
  std::size_t frames_ = 0;
  simd::AlignedDoubles rows_, scratch_, offset_, largest_;
};

}  // namespace weft::classifier::vibro
