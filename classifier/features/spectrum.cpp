#include "classifier/features/spectrum.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace weft::classifier {
namespace {

using simd::all;
using simd::Lanes;
using simd::load;
using simd::store;
using simd::width;

constexpr std::size_t least_padded = 16;         // so that a quarter of it can be split again
constexpr std::size_t step = Spectrum::signals;  // doubles per element: eight real, eight imaginary
constexpr std::size_t twiddles_per_butterfly = 6;  // w^j, w^2j, w^3j

struct Complex {
  Lanes re, im;
};

WEFT_INLINE Complex get(const double* element) {
  return {load(element), load(element + width)};
}
WEFT_INLINE void put(double* element, Complex v) {
  store(element, v.re);
  store(element + width, v.im);
}
WEFT_INLINE Complex operator+(Complex a, Complex b) {
  return {a.re + b.re, a.im + b.im};
}
WEFT_INLINE Complex operator-(Complex a, Complex b) {
  return {a.re - b.re, a.im - b.im};
}
WEFT_INLINE Complex times_i(Complex a) {
  return {-a.im, a.re};
}
// The same factor for all lanes, from its real and imaginary part.
WEFT_INLINE Complex times(Complex a, const double* w) {
  const Lanes re = all(w[0]), im = all(w[1]);
  return {a.re * re - a.im * im, a.im * re + a.re * im};
}
WEFT_INLINE Complex times_conjugate(Complex a, const double* w) {
  const Lanes re = all(w[0]), im = all(w[1]);
  return {a.re * re + a.im * im, a.im * re - a.re * im};
}

// Decimation in frequency by four: natural order in, quarters of the spectrum out.
WEFT_INLINE void split(double* x, std::size_t size, const double* w) {
  const std::size_t quarter = size / 4 * step;
  for (double* const end = x + quarter; x < end; x += step, w += twiddles_per_butterfly) {
    const Complex a = get(x), b = get(x + quarter), c = get(x + 2 * quarter),
                  d = get(x + 3 * quarter);
    const Complex even = a + c, odd = b + d, fall = a - c, turn = times_i(b - d);
    put(x, even + odd);
    put(x + quarter, times(fall - turn, w));
    put(x + 2 * quarter, times(even - odd, w + 2));
    put(x + 3 * quarter, times(fall + turn, w + 4));
  }
}

// Decimation in time by four with conjugate twiddles: takes split() back, times four.
WEFT_INLINE void join(double* x, std::size_t size, const double* w) {
  const std::size_t quarter = size / 4 * step;
  for (double* const end = x + quarter; x < end; x += step, w += twiddles_per_butterfly) {
    const Complex a = get(x), b = times_conjugate(get(x + quarter), w),
                  c = times_conjugate(get(x + 2 * quarter), w + 2),
                  d = times_conjugate(get(x + 3 * quarter), w + 4);
    const Complex even = a + c, odd = b + d, fall = a - c, turn = times_i(b - d);
    put(x, even + odd);
    put(x + quarter, fall + turn);
    put(x + 2 * quarter, even - odd);
    put(x + 3 * quarter, fall - turn);
  }
}

WEFT_INLINE void split_pair(double* x) {
  const Complex a = get(x), b = get(x + step);
  put(x, a + b);
  put(x + step, a - b);
}

// Forward transform of `size` elements, in the order that the splits leave.
void forward(double* x, std::size_t size, const double* w) {
  if (size == 2) split_pair(x);
  if (size < 4) return;
  split(x, size, w);
  const double* const next = w + size / 4 * twiddles_per_butterfly;
  for (std::size_t q = 0; q < 4; ++q) forward(x + q * size / 4 * step, size / 4, next);
}

WEFT_INLINE void convolve_single(double* x, const double* kernel) {
  put(x, times(get(x), kernel));
}

WEFT_INLINE void convolve_pair(double* x, const double* kernel) {
  const Complex a = get(x), b = get(x + step);
  const Complex sum = times(a + b, kernel), difference = times(a - b, kernel + 2);
  put(x, sum + difference);
  put(x + step, sum - difference);
}

// Forward transform, product with the kernel, inverse transform of four or eight elements or more.
// One quarter after the other to the end, so that all but the first levels stay in the nearest
// cache.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void convolve(double* x, std::size_t size, const double* w, const double* kernel) {
  const std::size_t quarter = size / 4;
  const double* const next = w + quarter * twiddles_per_butterfly;
  split(x, size, w);
  for (std::size_t q = 0; q < 4; ++q) {
    double* const part = x + q * quarter * step;
    const double* const factors = kernel + q * quarter * 2;
    if (quarter == 1) {
      convolve_single(part, factors);
    } else if (quarter == 2) {
      convolve_pair(part, factors);
    } else {
      convolve(part, quarter, next, factors);
    }
  }
  join(x, size, w);
}

std::vector<double> twiddles(std::size_t size) {
  std::vector<double> out;
  for (; size >= 4; size /= 4) {
    for (std::size_t j = 0; j < size / 4; ++j) {
      for (std::size_t power = 1; power <= 3; ++power) {
        const double angle =
            -2.0 * std::numbers::pi * static_cast<double>(power * j) / static_cast<double>(size);
        out.push_back(std::cos(angle));
        out.push_back(std::sin(angle));
      }
    }
  }
  return out;
}

// Two factors whose product is 2^exponent: one alone may overflow where the product with a signal
// does not.
struct PowerOfTwo {
  alignas(64) std::array<double, Spectrum::signals> first{};
  alignas(64) std::array<double, Spectrum::signals> second{};

  void set(std::size_t k, int exponent) {
    first[k] = std::ldexp(1.0, exponent / 2);
    second[k] = std::ldexp(1.0, exponent - exponent / 2);
  }
};

struct Scaling {
  PowerOfTwo in;   // brings the largest magnitude into [1/2, 1)
  PowerOfTwo out;  // and back; zero for a silent signal, which would show its partner's rounding
};

Scaling scaling_of(const std::array<double, Spectrum::signals>& top) {
  Scaling out;
  for (std::size_t k = 0; k < top.size(); ++k) {
    int exponent = 0;
    std::frexp(top[k], &exponent);
    out.in.set(k, -exponent);
    out.out.set(k, exponent);
    if (top[k] == 0.0) out.out.first[k] = 0.0;
  }
  return out;
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void find_top(const double* rows, std::size_t length, const double* offset, double* top) {
  for (std::size_t half = 0; half < step; half += width) {
    const Lanes zero = load(offset + half);
    Lanes most = all(0.0);
    for (std::size_t j = 0; j < length; ++j)
      most = simd::larger(most, simd::magnitude(load(rows + j * step + half) - zero));
    store(top + half, most);
  }
}

// The first level of the forward transform on signals less offset, scaled, times the chirp. At most
// half of the padded length is signal: the last two quarters are zeros that need not be written.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void split_signals(const double* rows, std::size_t length, const double* offset,
                   const PowerOfTwo& scale, const double* chirp, std::size_t padded,
                   const double* w, double* x) {
  const Complex zero = get(offset), first = get(scale.first.data()),
                second = get(scale.second.data());
  const auto chirped = [&](std::size_t j) {
    const Complex v = get(rows + j * step) - zero;
    return times({v.re * first.re * second.re, v.im * first.im * second.im}, chirp + 2 * j);
  };
  const std::size_t quarter = padded / 4;
  const Complex nothing{all(0.0), all(0.0)};
  for (std::size_t j = 0; j < quarter; ++j, w += twiddles_per_butterfly) {
    const Complex a = j < length ? chirped(j) : nothing;
    const Complex b = j + quarter < length ? chirped(j + quarter) : nothing;
    const Complex turn = times_i(b);
    put(x + j * step, a + b);
    put(x + (j + quarter) * step, times(a - turn, w));
    put(x + (j + 2 * quarter) * step, times(a - b, w + 2));
    put(x + (j + 3 * quarter) * step, times(a + turn, w + 4));
  }
}

// The last level of the inverse transform times the chirp, of the half that is asked for.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void join_signals(double* x, std::size_t padded, const double* chirp, std::size_t length,
                  const double* w) {
  const std::size_t quarter = padded / 4;
  for (std::size_t j = 0; j < quarter && j < length; ++j, w += twiddles_per_butterfly) {
    double* const at = x + j * step;
    const Complex a = get(at), b = times_conjugate(get(at + quarter * step), w),
                  c = times_conjugate(get(at + 2 * quarter * step), w + 2),
                  d = times_conjugate(get(at + 3 * quarter * step), w + 4);
    put(at, times((a + c) + (b + d), chirp + 2 * j));
    if (j + quarter < length)
      put(at + quarter * step, times((a - c) + times_i(b - d), chirp + 2 * (j + quarter)));
  }
}

// Z = A + iB with A, B Hermitian: A = (Z_k + conj Z_-k) / 2, B = (Z_k - conj Z_-k) / 2i.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void store_squares(const double* x, std::size_t length, double* out) {
  for (std::size_t k = 0; k <= length / 2; ++k) {
    const Complex z = get(x + k * step), m = get(x + (k == 0 ? 0 : length - k) * step);
    const Complex a{z.re + m.re, z.im - m.im}, b{z.re - m.re, z.im + m.im};
    put(out + k * step, {a.re * a.re + a.im * a.im, b.re * b.re + b.im * b.im});
  }
}

// A loop of its own over plain numbers: only so do compilers take roots of all lanes at once.
WEFT_CLONES("arch=x86-64-v4", "avx2")
void take_roots(double* rows, std::size_t count, const PowerOfTwo& scale) {
  const PowerOfTwo by = scale;
  for (std::size_t r = 0; r < count; ++r, rows += step) {
    for (std::size_t k = 0; k < step; ++k)
      rows[k] = 0.5 * std::sqrt(rows[k]) * by.first[k] * by.second[k];
  }
}

}  // namespace

Spectrum::Spectrum(std::size_t length)
    : length_(length),
      padded_(std::bit_ceil(std::max(least_padded, 2 * length - 1))),
      twiddle_(twiddles(padded_)),
      kernel_(2 * padded_) {
  simd::AlignedDoubles x(padded_ * step, 0.0);  // the first lane carries the conjugate chirp
  const double scale = 1.0 / static_cast<double>(padded_);
  for (std::size_t j = 0; j < length_; ++j) {
    // j^2 modulo 2 n in integers: the angle stays small and exact for any length.
    const auto square = static_cast<std::uint64_t>(j) * j % (2 * length_);
    const double angle =
        std::numbers::pi * static_cast<double>(square) / static_cast<double>(length_);
    chirp_.push_back(std::cos(angle));
    chirp_.push_back(-std::sin(angle));
    for (const std::size_t at : {j, (padded_ - j) % padded_}) {
      x[at * step] = std::cos(angle) * scale;
      x[at * step + width] = std::sin(angle) * scale;
    }
  }
  forward(x.data(), padded_, twiddle_.data());
  for (std::size_t k = 0; k < padded_; ++k) {
    kernel_[2 * k] = x[k * step];
    kernel_[2 * k + 1] = x[k * step + width];
  }
}

void Spectrum::magnitudes(const double* rows, const double* offset, simd::AlignedDoubles& scratch,
                          double* out) const {
  if (scratch.size() < padded_ * step) scratch.resize(padded_ * step);
  alignas(64) std::array<double, signals> top{};
  find_top(rows, length_, offset, top.data());
  const Scaling scaling = scaling_of(top);
  double* const x = scratch.data();
  const double* const w = twiddle_.data();
  split_signals(rows, length_, offset, scaling.in, chirp_.data(), padded_, w, x);
  const std::size_t quarter = padded_ / 4;
  for (std::size_t q = 0; q < 4; ++q)
    convolve(x + q * quarter * step, quarter, w + quarter * twiddles_per_butterfly,
             kernel_.data() + q * quarter * 2);
  join_signals(x, padded_, chirp_.data(), length_, w);
  store_squares(x, length_, out);
  take_roots(out, bins(), scaling.out);
}

const Spectrum& SpectrumCache::of(std::size_t length) {
  auto found = std::find_if(recent_.begin(), recent_.end(),
                            [=](const auto& s) { return s->length() == length; });
  if (found == recent_.end()) {
    if (recent_.size() == most) recent_.pop_back();
    recent_.push_back(std::make_unique<Spectrum>(length));
    found = recent_.end() - 1;
  }
  std::rotate(recent_.begin(), found, found + 1);
  return *recent_.front();
}

}  // namespace weft::classifier
