#include "classifier/vibro/real_transform.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

#include "classifier/features/fourier.hpp"

namespace weft::classifier::vibro {
namespace {

using fourier::Complex;
using fourier::get;
using fourier::put;
using simd::Lanes;
constexpr std::size_t width = simd::width;
constexpr std::size_t step = fourier::step<Lanes>;

// cos and sin of -2 pi part / whole.
std::pair<double, double> turn(std::size_t part, std::size_t whole) {
  const double angle =
      -2.0 * std::numbers::pi * static_cast<double>(part) / static_cast<double>(whole);
  return {std::cos(angle), std::sin(angle)};
}

std::size_t padded(std::size_t elements) {
  return (elements + width - 1) / width * width;
}

// The first radix that divides `elements`; else `elements`.
std::size_t radix_of(std::size_t elements) {
  for (const std::size_t radix : {4U, 2U, 3U, 5U})
    if (elements % radix == 0) return radix;
  return elements;
}

// Element a: samples 16 a, 16 a + 2 ... are its real parts, those after them its imaginary parts.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void load_samples(const double* samples, std::size_t elements, double mean, double* x) {
  const Lanes off = simd::all<Lanes>(mean);
  for (std::size_t a = 0; a < elements; ++a, samples += step, x += step) {
    const Lanes low = simd::load(samples) - off, high = simd::load(samples + width) - off;
    put(x, Complex<Lanes>{__builtin_shufflevector(low, high, 0, 2, 4, 6, 8, 10, 12, 14),
                          __builtin_shufflevector(low, high, 1, 3, 5, 7, 9, 11, 13, 15)});
  }
}

struct LevelJob {
  std::size_t part, stride;
  const double *root, *twiddle;
};

// Inputs are `part` x `stride` apart, the outputs of a butterfly `stride`.
template <std::size_t R>
WEFT_INLINE void split_level(const LevelJob& job, const double* x, double* y) {
  const double* w = job.twiddle;
  const std::size_t apart = job.part * job.stride * step;
  for (std::size_t j = 0; j < job.part; ++j, w += 2 * (R - 1), y += (R - 1) * job.stride * step) {
    for (std::size_t s = 0; s < job.stride; ++s, x += step, y += step) {
      std::array<Complex<Lanes>, R> v;
      for (std::size_t i = 0; i < R; ++i) v[i] = get<Lanes>(x + i * apart);
      if constexpr (R == 4) {
        fourier::split_four(v[0], v[1], v[2], v[3], w);
        for (std::size_t i = 0; i < R; ++i) put(y + i * job.stride * step, v[i]);
      } else {
        fourier::split_first<R>(v, job.root, w, y, job.stride * step);
      }
    }
  }
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void run_level(std::size_t radix, const LevelJob& job, const double* x, double* y) {
  if (radix == 2) split_level<2>(job, x, y);
  if (radix == 3) split_level<3>(job, x, y);
  if (radix == 4) split_level<4>(job, x, y);
  if (radix == 5) split_level<5>(job, x, y);
}

// Bins 0 to 7 of eight elements each, in order.
WEFT_INLINE void join_eight(Complex<Lanes>* v) {
  constexpr double none[] = {1.0, 0.0, 1.0, 0.0, 1.0, 0.0};
  constexpr double half = std::numbers::sqrt2 / 2.0;
  constexpr double turns[] = {1.0, 0.0, half, -half, 0.0, -1.0, -half, -half};
  fourier::split_four(v[0], v[2], v[4], v[6], none);
  fourier::split_four(v[1], v[3], v[5], v[7], none);
  Complex<Lanes> out[width];
  for (std::size_t k = 0; k < width / 2; ++k) {
    const auto odd = fourier::times(v[2 * k + 1], turns + 2 * k);
    out[k] = v[2 * k] + odd;
    out[k + width / 2] = v[2 * k] - odd;
  }
  for (std::size_t k = 0; k < width; ++k) v[k] = out[k];
}

// Bin k + m s of the half-length transform goes to [s][k] of `re` and `im` [8 x padded m].
WEFT_CLONES("arch=x86-64-v4", "avx2")
void join_lanes(const double* x, const double* between, std::size_t elements, double* re,
                double* im) {
  const std::size_t segment = padded(elements);
  for (std::size_t k = 0; k < segment; k += width, x += width * step, between += width * step) {
    Lanes real[width], imaginary[width];
    for (std::size_t i = 0; i < width; ++i) {
      const auto v = get<Lanes>(x + i * step), w = get<Lanes>(between + i * step);
      real[i] = v.re * w.re - v.im * w.im;
      imaginary[i] = v.im * w.re + v.re * w.im;
    }
    transpose(real);
    transpose(imaginary);
    Complex<Lanes> v[width];
    for (std::size_t i = 0; i < width; ++i) v[i] = {real[i], imaginary[i]};
    join_eight(v);
    for (std::size_t s = 0; s < width; ++s) {
      simd::store(re + s * segment + k, v[s].re);
      simd::store(im + s * segment + k, v[s].im);
    }
  }
}

// |A + T|^2 and |A - T|^2, four times the squares of two bins of the whole transform, from bins k
// and M - k of the half one: A = Z_k + conj Z_(M-k), T = -i w^k (Z_k - conj Z_(M-k)).
template <class V>
WEFT_INLINE void two_bins(Complex<V> z, Complex<V> mirror, Complex<V> w, V& first, V& second) {
  const Complex<V> a{z.re + mirror.re, z.im - mirror.im}, b{z.re - mirror.re, z.im + mirror.im};
  const Complex<V> t{b.re * w.re - b.im * w.im, b.im * w.re + b.re * w.im};
  const auto sum = a + t, difference = a - t;
  first = sum.re * sum.re + sum.im * sum.im;
  second = difference.re * difference.re + difference.im * difference.im;
}

WEFT_INLINE Lanes reversed(Lanes v) {
  return __builtin_shufflevector(v, v, 7, 6, 5, 4, 3, 2, 1, 0);
}

// Twice the sum of the magnitudes of the whole transform's bins in segment s < 4 of the half-length
// one, without its first bin, and of their mirrors in segment 7 - s.
WEFT_CLONES("arch=x86-64-v4", "avx2")
double add_segment(const double* re, const double* im, const double* apart, std::size_t s,
                   std::size_t elements) {
  const std::size_t segment = padded(elements);
  const double *const zr = re + s * segment, *const zi = im + s * segment;
  const double *const mr = re + (7 - s) * segment, *const mi = im + (7 - s) * segment;
  const double *const wr = apart + 2 * s * segment, *const wi = wr + segment;
  alignas(64) double square[2 * width];
  double sum[2 * width] = {};
  std::size_t k = 1;
  for (; k + width <= elements; k += width) {
    const std::size_t mirror = elements - k - (width - 1);
    Lanes first, second;
    two_bins<Lanes>({simd::load(zr + k), simd::load(zi + k)},
                    {reversed(simd::load(mr + mirror)), reversed(simd::load(mi + mirror))},
                    {simd::load(wr + k), simd::load(wi + k)}, first, second);
    simd::store(square, first);
    simd::store(square + width, second);
    for (std::size_t i = 0; i < 2 * width; ++i) sum[i] += std::sqrt(square[i]);
  }
  double out = 0.0;
  for (const double v : sum) out += v;
  for (; k < elements; ++k) {
    double first, second;
    two_bins<double>({zr[k], zi[k]}, {mr[elements - k], mi[elements - k]}, {wr[k], wi[k]}, first,
                     second);
    out += std::sqrt(first) + std::sqrt(second);
  }
  return out;
}

// Sum of the rest: the first bins of all segments.
double add_first_bins(const double* re, const double* im, const double* apart,
                      std::size_t elements) {
  const std::size_t segment = padded(elements);
  double out = 2.0 * std::abs(re[0] - im[0]) + 2.0 * std::sqrt(re[4 * segment] * re[4 * segment] +
                                                               im[4 * segment] * im[4 * segment]);
  for (std::size_t s = 1; s < 4; ++s) {
    const std::size_t at = s * segment, mirror = (8 - s) * segment;
    double first, second;
    two_bins<double>({re[at], im[at]}, {re[mirror], im[mirror]},
                     {apart[2 * at], apart[2 * at + segment]}, first, second);
    out += std::sqrt(first) + std::sqrt(second);
  }
  return out;
}

}  // namespace

bool RealTransform::fits(std::size_t length) {
  if (length == 0 || length % step != 0) return false;
  length /= step;
  for (const std::size_t factor : {2U, 3U, 5U})
    while (length % factor == 0) length /= factor;
  return length == 1;
}

RealTransform::RealTransform(std::size_t length)
    : elements_(length / step),
      between_(padded(elements_) * step),
      apart_(2 * 4 * padded(elements_)),
      from_(padded(elements_) * step),
      to_(padded(elements_) * step) {
  std::size_t left = elements_, stride = 1;
  while (left > 1) {
    const std::size_t radix = radix_of(left), part = left / radix;
    Level level{radix, part, stride, fourier::roots_of_unity(radix), {}};
    for (std::size_t j = 0; j < part; ++j) {
      for (std::size_t power = 1; power < radix; ++power) {
        const auto [re, im] = turn(power * j, left);
        level.twiddle.insert(level.twiddle.end(), {re, im});
      }
    }
    levels_.push_back(std::move(level));
    left = part;
    stride *= radix;
  }
  const std::size_t half = elements_ * width, segment = padded(elements_);
  for (std::size_t k = 0; k < elements_; ++k)
    for (std::size_t l = 0; l < width; ++l)
      std::tie(between_[k * step + l], between_[k * step + width + l]) = turn(k * l, half);
  for (std::size_t s = 0; s < 4; ++s) {
    for (std::size_t k = 0; k < elements_; ++k) {
      const auto [re, im] = turn(s * elements_ + k, 2 * half);  // times -i
      apart_[2 * s * segment + k] = im;
      apart_[(2 * s + 1) * segment + k] = -re;
    }
  }
}

double RealTransform::sum_of_magnitudes(std::span<const double> samples, double mean) {
  load_samples(samples.data(), elements_, mean, from_.data());
  for (const Level& level : levels_) {
    run_level(level.radix, {level.part, level.stride, level.root.data(), level.twiddle.data()},
              from_.data(), to_.data());
    std::swap(from_, to_);
  }
  double* const re = to_.data();
  double* const im = re + width * padded(elements_);
  join_lanes(from_.data(), between_.data(), elements_, re, im);
  double twice = add_first_bins(re, im, apart_.data(), elements_);
  for (std::size_t s = 0; s < 4; ++s) twice += add_segment(re, im, apart_.data(), s, elements_);
  return 0.5 * twice;
}

}  // namespace weft::classifier::vibro
