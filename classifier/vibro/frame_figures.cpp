#include "classifier/vibro/frame_figures.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "classifier/vibro/filters.hpp"

namespace weft::classifier::vibro {
namespace {

using simd::Lanes;
using simd::load;
using simd::store;
constexpr std::size_t width = simd::width;
constexpr std::size_t lanes = ShortTimeSpectrum::lanes;
constexpr double rolloff_share = 0.85;
constexpr std::size_t classes_at_once = 12;  // that stay in registers
using Integers = std::int64_t __attribute__((vector_size(width * sizeof(std::int64_t))));

struct Sums {
  Lanes magnitude{}, moment{}, loudest{};
};

WEFT_INLINE Sums first_sums(const double* at, const BinTables& tables) {
  Sums out;
  for (std::size_t k = 0; k < tables.bins; ++k, at += lanes) {
    const Lanes m = load(at);
    out.magnitude += m;
    out.moment += m * tables.frequency_hz[k];
    out.loudest = simd::larger<Lanes>(out.loudest, m);
  }
  return out;
}

// Of eight frames; figures go to out[from ...].
WEFT_INLINE void shape_figures(const double* at, const BinTables& tables, std::size_t from,
                               FrameFigures& out) {
  const Sums sums = first_sums(at, tables);
  const Lanes none{}, one = simd::all<Lanes>(1.0);
  const Lanes whole = sums.magnitude > none ? sums.magnitude : one;
  const Lanes centroid = sums.moment / whole, share = sums.magnitude * rolloff_share;
  Lanes spread{}, so_far{};
  Integers below{};  // bins whose running sum does not reach the share
  const double* bin = at;
  for (std::size_t k = 0; k < tables.bins; ++k, bin += lanes) {
    const Lanes m = load(bin), away = simd::all<Lanes>(tables.frequency_hz[k]) - centroid;
    spread += m * away * away;
    so_far += m;
    below -= so_far < share;
  }
  spread /= whole;
  store(out.centroid_hz.data() + from, centroid);
  store(out.bandwidth_hz.data() + from, spread);
  store(out.loudest.data() + from, sums.loudest * sums.loudest);
  for (std::size_t f = 0; f < width; ++f) {
    out.bandwidth_hz[from + f] = std::sqrt(out.bandwidth_hz[from + f]);
    out.rolloff_hz[from + f] = tables.frequency_hz[static_cast<std::size_t>(below[f])];
    out.silent[from + f] = !(sums.magnitude[f] > 0.0);
  }
}

// Power of each class in eight frames: [12 x 8].
WEFT_INLINE void class_powers(const double* at, const BinTables& tables, Lanes* power) {
  for (std::size_t c = 0; c < pitch_classes; c += classes_at_once) {
    Lanes sum[classes_at_once] = {};
    const double* bin = at;
    const double* weight = tables.chroma.data() + c;
    for (std::size_t k = 0; k < tables.bins; ++k, bin += lanes, weight += pitch_classes) {
      const Lanes m = load(bin), square = m * m;
      for (std::size_t i = 0; i < classes_at_once; ++i) sum[i] += square * weight[i];
    }
    for (std::size_t i = 0; i < classes_at_once; ++i) power[c + i] = sum[i];
  }
}

WEFT_INLINE void chroma_figure(const double* at, const BinTables& tables, std::size_t from,
                               FrameFigures& out) {
  Lanes power[pitch_classes], sum{}, most{};
  class_powers(at, tables, power);
  for (const Lanes& p : power) {
    sum += p;
    most = simd::larger<Lanes>(most, p);
  }
  const Lanes least = simd::all<Lanes>(std::numeric_limits<double>::min());
  store(out.chroma.data() + from,
        sum / static_cast<double>(pitch_classes) / (most > least ? most : simd::all<Lanes>(1.0)));
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void fill_figures(const double* magnitudes, const BinTables& tables, bool chroma,
                  FrameFigures& out) {
  for (std::size_t from = 0; from < lanes; from += width) {
    shape_figures(magnitudes + from, tables, from, out);
    if (chroma) chroma_figure(magnitudes + from, tables, from, out);
  }
}

// log2 of the product of so many numbers, each 2^exponent times a mantissa in [1, 2).
constexpr std::size_t bins_in_a_product = 512;

WEFT_CLONES("arch=x86-64-v4", "avx2")
void product_parts(const double* magnitudes, std::size_t bins, double least_power, double* mantissa,
                   std::int64_t* exponent) {
  constexpr std::int64_t fraction_bits = 52, bias = 1023;
  constexpr std::int64_t fraction = (std::int64_t{1} << fraction_bits) - 1;
  for (std::size_t from = 0; from < lanes; from += width) {
    const Lanes least = simd::all<Lanes>(least_power);
    Lanes product = simd::all<Lanes>(1.0);
    Integers sum{};
    const double* at = magnitudes + from;
    for (std::size_t k = 0; k < bins; ++k, at += lanes) {
      const Lanes m = load(at);
      const auto bits = reinterpret_cast<Integers>(simd::larger<Lanes>(m * m, least));
      sum += (bits >> fraction_bits) - bias;
      product *= reinterpret_cast<Lanes>((bits & fraction) | (bias << fraction_bits));
    }
    store(mantissa + from, product);
    for (std::size_t f = 0; f < width; ++f) exponent[from + f] = sum[f];
  }
}

}  // namespace

BinTables::BinTables(double rate_hz, std::size_t length) : bins(length / 2 + 1) {
  for (std::size_t k = 0; k < bins; ++k)
    frequency_hz.push_back(rate_hz * static_cast<double>(k) / static_cast<double>(length));
  const std::vector<double> weights = chroma_weights(rate_hz, length);
  for (std::size_t k = 0; k < bins; ++k)
    for (std::size_t c = 0; c < pitch_classes; ++c) chroma.push_back(weights[c * bins + k]);
  for (const double db : a_weighting_db(rate_hz, length)) mean_a_weighting_db += db;
  mean_a_weighting_db /= static_cast<double>(bins);
}

FrameFigures frame_figures(const double* magnitudes, const BinTables& tables, bool chroma) {
  FrameFigures out;
  fill_figures(magnitudes, tables, chroma, out);
  return out;
}

PerFrame sum_of_decibels(const double* magnitudes, std::size_t bins, double least_power) {
  PerFrame out{};
  for (std::size_t first = 0; first < bins; first += bins_in_a_product) {
    PerFrame mantissa;
    std::array<std::int64_t, lanes> exponent;
    product_parts(magnitudes + first * lanes, std::min(bins_in_a_product, bins - first),
                  least_power, mantissa.data(), exponent.data());
    for (std::size_t f = 0; f < lanes; ++f)
      out[f] += static_cast<double>(exponent[f]) + std::log2(mantissa[f]);
  }
  for (double& v : out) v *= 10.0 * std::log10(2.0);
  return out;
}

}  // namespace weft::classifier::vibro
