#include "classifier/vibro/short_time.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include "classifier/features/fourier.hpp"
#include "classifier/vibro/real_transform.hpp"

namespace weft::classifier::vibro {
namespace {

using fourier::Complex;
using fourier::get;
using fourier::put;
using simd::Lanes;
constexpr std::size_t width = simd::width, lanes = ShortTimeSpectrum::lanes;
constexpr std::size_t step = fourier::step<Lanes>;
constexpr std::size_t quarters = 4;  // quarters of a frame, one hop each
// Square roots of this number of bins run while the bins before them are added up: a processor
// computes roots in parallel with products and sums.
constexpr std::size_t bins_at_once = 2;

// Sixteen frames and the tables of their length.
struct Job {
  const double* by_hop;  // of the first frame
  std::size_t columns, hop;
  const double* hann;
  const double* twiddle;
  const std::uint32_t* place;
};

// Transposes eight hops: row j of `to` has sample j of each.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void turn_eight(const double* samples, std::size_t hop, double* to, std::size_t columns) {
  for (std::size_t j = 0; j < hop; j += width) {
    Lanes v[width];
    for (std::size_t h = 0; h < width; ++h) v[h] = simd::load(samples + h * hop + j);
    transpose(v);
    for (std::size_t i = 0; i < width; ++i) simd::store(to + (j + i) * columns, v[i]);
  }
}

// The largest magnitude in each frame.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void find_largest(const Job& job, double* out) {
  Complex<Lanes> most{}, least{};
  for (std::size_t q = 0; q < quarters; ++q) {
    const double* at = job.by_hop + q;
    const double* const hann = job.hann + q * job.hop;
    for (std::size_t j = 0; j < job.hop; ++j, at += job.columns) {
      const auto v = get<Lanes>(at) * hann[j];
      most = {simd::larger<Lanes>(most.re, v.re), simd::larger<Lanes>(most.im, v.im)};
      least = {simd::smaller<Lanes>(least.re, v.re), simd::smaller<Lanes>(least.im, v.im)};
    }
  }
  put(out, Complex<Lanes>{simd::larger<Lanes>(most.re, -least.re),
                          simd::larger<Lanes>(most.im, -least.im)});
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void forward(double* x, std::size_t size, const double* w) {
  fourier::forward<Lanes>(x, size, w, forward);
}

// The first level of the transforms of sixteen frames, weighted and scaled.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void first_level(const Job& job, const PowerOfTwo& scale, double* x) {
  const auto one = get<Lanes>(scale.first.data()), two = get<Lanes>(scale.second.data());
  const std::size_t quarter = job.hop * step;
  const double* w = job.twiddle;
  const double* at = job.by_hop;
  for (std::size_t j = 0; j < job.hop; ++j, x += step, at += job.columns) {
    std::array<Complex<Lanes>, quarters> v;
    for (std::size_t q = 0; q < quarters; ++q) {
      const auto frames = get<Lanes>(at + q) * job.hann[j + q * job.hop];
      v[q] = {frames.re * one.re * two.re, frames.im * one.im * two.im};
    }
    fourier::split_four(v[0], v[1], v[2], v[3], w);
    w += fourier::twiddles_per_butterfly;
    for (std::size_t q = 0; q < quarters; ++q) put(x + q * quarter, v[q]);
  }
}

struct Totals {
  Complex<Lanes> magnitude{}, moment{}, loudest{};  // low and high frames
};

// Computes magnitudes a few bins ahead of the sums.
template <class Make>
struct Ahead {
  Make magnitudes_of;  // (from, end)
  std::size_t bins, made = 0;

  WEFT_INLINE void of(std::size_t end) {
    while (made < bins && made < end + bins_at_once) {
      const std::size_t next = std::min(made + bins_at_once, bins);
      magnitudes_of(made, next);
      made = next;
    }
  }
};

// Adds up the bins `from` to `end` of sixteen frames, and their power with a row of `classes`
// weights each; adds the latter to `power` [classes].
template <std::size_t classes, class Make>
WEFT_INLINE void add_bins(std::size_t from, std::size_t end, Ahead<Make>& ahead,
                          const double* frequency_hz, const double* weight, const double* rows,
                          Totals& totals, Complex<Lanes>* power) {
  Complex<Lanes> sum[std::max<std::size_t>(classes, 1)];
  for (std::size_t i = 0; i < classes; ++i) sum[i] = power[i];
  Totals own = totals;
  for (std::size_t first = from; first < end; first += bins_at_once) {
    const std::size_t last = std::min(first + bins_at_once, end);
    ahead.of(last);
    for (std::size_t k = first; k < last; ++k, weight += classes) {
      const auto m = get<Lanes>(rows + k * lanes);
      own.magnitude = own.magnitude + m;
      own.moment = own.moment + m * frequency_hz[k];
      own.loudest = {simd::larger<Lanes>(own.loudest.re, m.re),
                     simd::larger<Lanes>(own.loudest.im, m.im)};
      const Complex<Lanes> square{m.re * m.re, m.im * m.im};
      for (std::size_t i = 0; i < classes; ++i) sum[i] = sum[i] + square * weight[i];
    }
  }
  totals = own;
  for (std::size_t i = 0; i < classes; ++i) power[i] = sum[i];
}

// All bins; `magnitudes_of` computes their magnitudes.
template <class Make>
WEFT_INLINE void add_all_bins(const BinTables& tables, bool chroma, Make magnitudes_of,
                              const double* rows, BinSums& out) {
  const double* const hz = tables.frequency_hz.data();
  Ahead<Make> ahead{magnitudes_of, tables.bins};
  Totals totals;
  // Twice around the circle, so that near classes are contiguous.
  Complex<Lanes> power[pitch_classes + near_classes] = {};
  if (chroma) {
    add_bins<pitch_classes>(0, tables.wide_bins, ahead, hz, tables.wide_chroma.data(), rows, totals,
                            power);
    const double* weight = tables.near_chroma.data();
    for (const ClassRun& run : tables.runs) {
      add_bins<near_classes>(run.first_bin, run.end_bin, ahead, hz, weight, rows, totals,
                             power + run.first_class);
      weight += (run.end_bin - run.first_bin) * near_classes;
    }
  } else {
    add_bins<0>(0, tables.bins, ahead, hz, nullptr, rows, totals, power);
  }
  put(out.magnitude.data(), totals.magnitude);
  put(out.moment_hz.data(), totals.moment);
  put(out.loudest.data(), totals.loudest);
  for (std::size_t c = 0; c < pitch_classes; ++c)
    put(out.power[c].data(), c < near_classes ? power[c] + power[pitch_classes + c] : power[c]);
}

// Magnitudes of the transforms in the order of the bins, and their sums; the bins are scattered in
// `x`.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void gather(const Job& job, const PowerOfTwo& scale, const double* x, const BinTables& tables,
            bool chroma, double* to, BinSums& out) {
  const std::size_t length = quarters * job.hop;
  const std::uint32_t* const place = job.place;
  add_all_bins(
      tables, chroma,
      [&](std::size_t from, std::size_t end) __attribute__((always_inline)) {
        for (std::size_t k = from; k < end; ++k)
          put(to + k * lanes,
              fourier::squares_of(get<Lanes>(x + place[k] * step),
                                  get<Lanes>(x + place[(length - k) % length] * step)));
        compute_roots<lanes>(to + from * lanes, end - from, scale);
      },
      to, out);
}

// Sums of existing magnitudes.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void add_up(const BinTables& tables, bool chroma, const double* rows, BinSums& out) {
  add_all_bins(tables, chroma, [](std::size_t, std::size_t) __attribute__((always_inline)){}, rows,
               out);
}

using simd::load;
using simd::store;
constexpr std::size_t halves = frame_lanes / width;
constexpr double rolloff_share = 0.85;
using Integers = std::int64_t __attribute__((vector_size(width * sizeof(std::int64_t))));

// Splits a double above 0 by its bits into a power of two and a mantissa in [1, 2).
constexpr std::int64_t fraction_bits = 52, bias = 1023;
constexpr std::int64_t fraction = (std::int64_t{1} << fraction_bits) - 1;
WEFT_INLINE Lanes mantissa_of(Integers bits) {
  return reinterpret_cast<Lanes>((bits & fraction) | (bias << fraction_bits));
}
// Number of mantissas multiplied before the exponent of the product is removed.
constexpr std::size_t bins_in_a_product = 512;

// Sums of eight frames about their centroids.
struct Shape {
  Lanes centroid, share;
  Lanes spread{}, so_far{}, product = simd::all<Lanes>(1.0);
  Integers below{};  // bins with a running sum below the share
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

// Each half has its own chains of sums, so neither waits for the other.
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

FrameSize FrameSize::of(std::size_t samples) {
  FrameSize out;
  out.length = std::min(out.length, std::bit_floor(std::max<std::size_t>(samples, 2)));
  out.hop = std::clamp<std::size_t>(out.length / 4, 1, out.hop);
  return out;
}

ShortTimeSpectrum::ShortTimeSpectrum(FrameSize size)
    : size_(size),
      twiddle_(fourier::twiddles(1, size.length)),
      place_(fourier::places(size.length)),
      elements_(size.length * step) {
  for (std::size_t i = 0; i < size.length; ++i)
    hann_.push_back(0.5 - 0.5 * std::cos(2.0 * std::numbers::pi * static_cast<double>(i) /
                                         static_cast<double>(size.length)));
}

void ShortTimeSpectrum::start(std::span<const double> samples) {
  const std::size_t hop = size_.hop, before = size_.hops() / 2;
  frames_ = size_.count(samples.size());
  const std::size_t frames = (frames_ + lanes - 1) / lanes * lanes;
  columns_ = (frames + size_.hops() + width - 1) / width * width;
  // Windows of the same length as the last one use the same places.
  if (samples.size() != samples_) by_hop_.assign(hop * columns_, 0.0);
  samples_ = samples.size();
  const std::size_t group = hop < width ? 0 : width * hop;
  std::size_t done = 0;
  for (; group > 0 && done < samples.size(); done += group) {
    const double* from = samples.data() + done;
    if (samples.size() - done < group) {
      last_hops_.assign(group, 0.0);
      std::copy(samples.begin() + static_cast<std::ptrdiff_t>(done), samples.end(),
                last_hops_.begin());
      from = last_hops_.data();
    }
    turn_eight(from, hop, by_hop_.data() + before + done / hop, columns_);
  }
  for (; done < samples.size(); ++done)
    by_hop_[done % hop * columns_ + before + done / hop] = samples[done];
}

BinSums ShortTimeSpectrum::magnitudes(std::size_t first, const BinTables& tables, bool chroma,
                                      double* to) {
  BinSums out;
  const double* const by_hop = by_hop_.data() + first;
  const std::size_t existing = std::min(lanes, frames_ - first);
  if (size_.hops() < quarters) {  // a frame of two: the second sample, with weight 1, in both bins
    for (std::size_t f = 0; f < lanes; ++f)
      to[f] = to[lanes + f] = f < existing ? std::abs(by_hop[f + 1]) : 0.0;
    add_up(tables, chroma, to, out);
    return out;
  }
  const Job job{by_hop, columns_, size_.hop, hann_.data(), twiddle_.data(), place_.data()};
  PerFrame largest;
  find_largest(job, largest.data());
  // Frames after the last one still begin inside the window but do not belong to it.
  std::fill(largest.begin() + static_cast<std::ptrdiff_t>(existing), largest.end(), 0.0);
  Scaling scaling = scaling_of(largest.data(), lanes);
  for (std::size_t f = existing; f < lanes; ++f) scaling.in.first[f] = 0.0;
  double* const x = elements_.data();
  first_level(job, scaling.in, x);
  const double* const levels = twiddle_.data() + size_.hop * fourier::twiddles_per_butterfly;
  for (std::size_t q = 0; q < quarters; ++q) forward(x + q * size_.hop * step, size_.hop, levels);
  gather(job, scaling.out, x, tables, chroma, to, out);
  return out;
}

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
