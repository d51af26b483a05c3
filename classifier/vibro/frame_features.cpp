#include "classifier/vibro/frame_features.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace weft::classifier::vibro {
namespace {

using simd::Lanes;
using simd::load;
using simd::store;
constexpr std::size_t width = simd::width, halves = frame_lanes / width;
constexpr double rolloff_share = 0.85;
using Integers = std::int64_t __attribute__((vector_size(width * sizeof(std::int64_t))));

// A power of two times a mantissa in [1, 2), by the bits of a double above 0.
constexpr std::int64_t fraction_bits = 52, bias = 1023;
constexpr std::int64_t fraction = (std::int64_t{1} << fraction_bits) - 1;
WEFT_INLINE Lanes mantissa_of(Integers bits) {
  return reinterpret_cast<Lanes>((bits & fraction) | (bias << fraction_bits));
}
// Mantissas that are multiplied before the product's own exponent is taken off.
constexpr std::size_t bins_in_a_product = 512;

// What is added up of eight frames about their centroids.
struct Shape {
  Lanes centroid, share;
  Lanes spread{}, so_far{}, product = simd::all<Lanes>(1.0);
  Integers below{};  // bins whose running sum does not reach the share
  Integers exponent{};

  WEFT_INLINE void add(Lanes magnitude, Lanes frequency_hz, Lanes least_power) {
    const Lanes away = frequency_hz - centroid;
    spread += magnitude * away * away;
    so_far += magnitude;
    below -= so_far < share;
    const auto bits =
        reinterpret_cast<Integers>(simd::larger<Lanes>(magnitude * magnitude, least_power));
    exponent += bits >> fraction_bits;
    product *= mantissa_of(bits);
  }
  WEFT_INLINE void shorten_product() {
    const auto bits = reinterpret_cast<Integers>(product);
    exponent += (bits >> fraction_bits) - bias;
    product = mantissa_of(bits);
  }
};

// Each half's sums have chains of their own: neither waits for the other.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void add_shapes(const double* magnitudes, const BinTables& tables, const PerFrame& centroid_hz,
                const PerFrame& share, double least_power, FrameFeatures& out) {
  Shape low{load(centroid_hz.data()), load(share.data())},
      high{load(centroid_hz.data() + width), load(share.data() + width)};
  const Lanes least = simd::all<Lanes>(least_power);
  const double* at = magnitudes;
  for (std::size_t first = 0; first < tables.bins; first += bins_in_a_product) {
    const std::size_t end = std::min(first + bins_in_a_product, tables.bins);
    for (std::size_t k = first; k < end; ++k, at += frame_lanes) {
      const Lanes hz = simd::all<Lanes>(tables.frequency_hz[k]);
      low.add(load(at), hz, least);
      high.add(load(at + width), hz, least);
    }
    low.shorten_product();
    high.shorten_product();
  }
  const auto biases = static_cast<std::int64_t>(tables.bins) * bias;
  for (std::size_t h = 0; h < halves; ++h) {
    const Shape& own = h == 0 ? low : high;
    store(out.bandwidth_hz.data() + h * width, own.spread);
    store(out.decibels.data() + h * width, own.product);
    for (std::size_t f = 0; f < width; ++f) {
      out.rolloff_hz[h * width + f] = tables.frequency_hz[static_cast<std::size_t>(own.below[f])];
      out.decibels[h * width + f] =
          static_cast<double>(own.exponent[f] - biases) + std::log2(out.decibels[h * width + f]);
    }
  }
}

double compute_chroma(const BinSums& sums, std::size_t frame) {
  double sum = 0.0, most = 0.0;
  for (const PerFrame& power : sums.power) {
    sum += power[frame];
    most = std::max(most, power[frame]);
  }
  return sum / static_cast<double>(pitch_classes) /
         (most > std::numeric_limits<double>::min() ? most : 1.0);
}

}  // namespace

FrameFeatures frame_features(const double* magnitudes, const BinSums& sums, const BinTables& tables,
                             double least_power) {
  FrameFeatures out;
  PerFrame whole, share;
  for (std::size_t f = 0; f < frame_lanes; ++f) {
    out.silent[f] = !(sums.magnitude[f] > 0.0);
    whole[f] = out.silent[f] ? 1.0 : sums.magnitude[f];
    out.centroid_hz[f] = sums.moment_hz[f] / whole[f];
    share[f] = sums.magnitude[f] * rolloff_share;
    out.chroma[f] = compute_chroma(sums, f);
  }
  add_shapes(magnitudes, tables, out.centroid_hz, share, least_power, out);
  for (std::size_t f = 0; f < frame_lanes; ++f) {
    out.bandwidth_hz[f] = std::sqrt(out.bandwidth_hz[f] / whole[f]);
    out.decibels[f] *= 10.0 * std::log10(2.0);
  }
  return out;
}

}  // namespace weft::classifier::vibro
