#include "classifier/vibro/short_time.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace weft::classifier::vibro {
namespace {

using simd::Lanes;
constexpr std::size_t lanes = ShortTimeSpectrum::lanes;

// rows[i][f] = samples[i + f hop] hann[i], and the largest magnitude of each f.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void frame(const double* samples, std::size_t hop, const std::vector<double>& hann, double* rows,
           double* largest) {
  Lanes low{}, high{};
  for (std::size_t i = 0; i < hann.size(); ++i, rows += lanes) {
    const double* at = samples + i;
    for (std::size_t f = 0; f < lanes; ++f, at += hop) rows[f] = *at * hann[i];
    low = simd::larger<Lanes>(low, simd::magnitude<Lanes>(simd::load(rows)));
    high = simd::larger<Lanes>(high, simd::magnitude<Lanes>(simd::load(rows + simd::width)));
  }
  simd::store(largest, low);
  simd::store(largest + simd::width, high);
}

}  // namespace

FrameSize FrameSize::of(std::size_t samples) {
  FrameSize out;
  out.length = std::min(out.length, std::bit_floor(std::max<std::size_t>(samples, 2)));
  out.hop = std::clamp<std::size_t>(out.length / 4, 1, out.hop);
  return out;
}

ShortTimeSpectrum::ShortTimeSpectrum(FrameSize size)
    : size_(size),
      spectrum_(size.length),
      rows_(size.length * lanes),
      offset_(lanes, 0.0),
      largest_(lanes, 0.0) {
  for (std::size_t i = 0; i < size.length; ++i)
    hann_.push_back(0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * static_cast<double>(i) /
                                         static_cast<double>(size.length)));
}

void ShortTimeSpectrum::start(std::span<const double> samples) {
  frames_ = size_.count(samples.size());
  const std::size_t blocks = (frames_ + lanes - 1) / lanes;
  padded_.assign((blocks * lanes - 1) * size_.hop + size_.length, 0.0);
  std::copy(samples.begin(), samples.end(),
            padded_.begin() + static_cast<std::ptrdiff_t>(size_.length / 2));
}

const double* ShortTimeSpectrum::magnitudes(std::size_t first) {
  frame(padded_.data() + first * size_.hop, size_.hop, hann_, rows_.data(), largest_.data());
  // Frames behind the last one begin in the window still: they are no frames of it.
  for (std::size_t f = std::min(lanes, frames_ - first); f < lanes; ++f) {
    for (std::size_t i = 0; i < size_.length; ++i) rows_[i * lanes + f] = 0.0;
    largest_[f] = 0.0;
  }
  return spectrum_.magnitudes<Lanes>(rows_.data(), offset_.data(), largest_.data(), scratch_);
}

}  // namespace weft::classifier::vibro
