#include "classifier/features/spectrum.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <tuple>
#include <utility>

#include "classifier/features/fourier.hpp"

namespace weft::classifier {
namespace {

using fourier::Complex;
using fourier::get;
using fourier::put;
using fourier::step;
using fourier::times;
using simd::Lanes;

constexpr std::size_t least_part = 4;    // so that a part can be split again
constexpr std::size_t most_direct = 16;  // samples; a convolution of 32 costs more

// Radix and part: their product is the shortest transform of at least `least` elements, a quarter
// longer at most.
std::pair<std::size_t, std::size_t> first_cut(std::size_t least) {
  std::pair<std::size_t, std::size_t> best{4, std::bit_ceil(std::max(4 * least_part, least)) / 4};
  for (const std::size_t radix : {5U, 6U, 7U}) {
    const std::size_t part = std::bit_ceil(std::max(least_part, (least + radix - 1) / radix));
    if (radix * part < best.first * best.second) best = {radix, part};
  }
  return best;
}

// exp(-2 pi i part / whole)
void append_turn(std::vector<double>& out, std::size_t part, std::size_t whole) {
  const double angle =
      -2.0 * std::numbers::pi * static_cast<double>(part) / static_cast<double>(whole);
  out.push_back(std::cos(angle));
  out.push_back(std::sin(angle));
}

// Of the first level, then of the levels by four, largest first.
std::vector<double> twiddles(std::size_t radix, std::size_t part) {
  std::vector<double> out;
  out.reserve(2 * (radix - 1) * part + 2 * part);
  for (std::size_t j = 0; j < part; ++j)
    for (std::size_t power = 1; power < radix; ++power) append_turn(out, power * j, radix * part);
  for (; part >= 4; part /= 4)
    for (std::size_t j = 0; j < part / 4; ++j)
      for (std::size_t power = 1; power <= 3; ++power) append_turn(out, power * j, part);
  return out;
}

// cos and sin of 2 pi k / radix, zeros exact.
std::vector<double> roots_of_unity(std::size_t radix) {
  std::vector<double> out;
  for (std::size_t k = 0; k < radix; ++k) append_turn(out, radix - k, radix);
  for (double& v : out) v = std::abs(v) < 1e-12 ? 0.0 : v;
  return out;
}

// Two factors whose product is 2^exponent: one alone may overflow where the product with a signal
// does not.
struct PowerOfTwo {
  alignas(64) std::array<double, Spectrum::most_signals> first{};
  alignas(64) std::array<double, Spectrum::most_signals> second{};

  void set(std::size_t k, int exponent) {
    first[k] = power(exponent / 2);
    second[k] = power(exponent - exponent / 2);
  }

 private:
  // From the exponent's bits: half an exponent of a double is that of a normal number.
  static double power(int exponent) {
    return std::bit_cast<double>(static_cast<std::uint64_t>(1023 + exponent) << 52);
  }
};

// std::frexp's exponent, by the bits where the number is normal.
int exponent_of(double v) {
  const auto biased = static_cast<int>(std::bit_cast<std::uint64_t>(v) >> 52 & 0x7ff);
  if (biased != 0 && biased != 0x7ff) return biased - 1022;
  int exponent = 0;
  if (v > 0.0) std::frexp(v, &exponent);
  return exponent;
}

struct Scaling {
  PowerOfTwo in;   // brings the largest magnitude into [1/2, 1)
  PowerOfTwo out;  // and back; zero for a silent signal, which would show its partner's rounding
};

Scaling scaling_of(const double* top, std::size_t signals) {
  Scaling out;
  for (std::size_t k = 0; k < signals; ++k) {
    const int exponent = exponent_of(top[k]);
    out.in.set(k, -exponent);
    out.out.set(k, exponent);
    if (top[k] == 0.0) out.out.first[k] = 0.0;
  }
  return out;
}

// Sixteen signals (V = Lanes) or two (double) and the tables of their length.
struct Job {
  const double* rows;
  const double* offset;
  const double* largest;
  std::size_t length, radix, part;
  const double* root;
  const double* first;   // twiddles of the first level
  const double* levels;  // of the others
  const double* chirp;
  const double* kernel;
};

// The first level of the forward transform on signals less offset, scaled, times the chirp. At most
// half of the elements, rounded up to whole parts, is signal: zeros need not be written.
template <class V, std::size_t R>
WEFT_INLINE void split_signals(const Job& job, const PowerOfTwo& scale, double* x) {
  const auto zero = get<V>(job.offset), one = get<V>(scale.first.data()),
             two = get<V>(scale.second.data());
  const std::size_t part = job.part, length = job.length;
  const double* w = job.first;
  for (std::size_t j = 0; j < part; ++j, w += 2 * (R - 1)) {
    std::array<Complex<V>, (R + 1) / 2> in{};
    for (std::size_t m = 0, at = j; m < in.size(); ++m, at += part) {
      if (at >= length) continue;
      const auto v = get<V>(job.rows + at * step<V>) - zero;
      in[m] = times(Complex<V>{v.re * one.re * two.re, v.im * one.im * two.im}, job.chirp + 2 * at);
    }
    fourier::split_first<R>(in, job.root, w, x + j * step<V>, part * step<V>);
  }
}

// The last level of the inverse transform times the chirp, of the half that is asked for.
template <class V, std::size_t R>
WEFT_INLINE void join_signals(const Job& job, double* x) {
  const std::size_t part = job.part, length = job.length;
  const double* w = job.first;
  for (std::size_t j = 0; j < part && j < length; ++j, w += 2 * (R - 1)) {
    const auto out =
        fourier::join_first<R, (R + 1) / 2, V>(x + j * step<V>, part * step<V>, job.root, w);
    for (std::size_t m = 0, at = j; m < out.size() && at < length; ++m, at += part)
      put(x + at * step<V>, times(out[m], job.chirp + 2 * at));
  }
}

// Z = A + iB with A, B Hermitian: A = (Z_k + conj Z_-k) / 2, B = (Z_k - conj Z_-k) / 2i. Squares of
// 2A and 2B take the place of Z_k, which no later k needs.
template <class V>
WEFT_INLINE void take_squares(double* x, std::size_t length) {
  for (std::size_t k = 0; k <= length / 2; ++k) {
    const auto z = get<V>(x + k * step<V>), m = get<V>(x + (k == 0 ? 0 : length - k) * step<V>);
    const Complex<V> a{z.re + m.re, z.im - m.im}, b{z.re - m.re, z.im + m.im};
    put(x + k * step<V>, Complex<V>{a.re * a.re + a.im * a.im, b.re * b.re + b.im * b.im});
  }
}

// A loop of its own over plain numbers: only so do compilers take roots of all lanes at once.
template <class V>
WEFT_INLINE void take_roots(double* rows, std::size_t count, const PowerOfTwo& scale) {
  const PowerOfTwo by = scale;
  for (std::size_t r = 0; r < count; ++r, rows += step<V>) {
    for (std::size_t k = 0; k < step<V>; ++k)
      rows[k] = 0.5 * std::sqrt(rows[k]) * by.first[k] * by.second[k];
  }
}

template <class V, std::size_t R, class Convolve>
WEFT_INLINE void transform_by(const Job& job, const PowerOfTwo& scale, double* x,
                              Convolve convolve) {
  split_signals<V, R>(job, scale, x);
  for (std::size_t q = 0; q < R; ++q)
    convolve(x + q * job.part * step<V>, job.part, job.levels, job.kernel + q * job.part * 2);
  join_signals<V, R>(job, x);
}

// Term by term, for the shortest signals; four times the squares, as take_squares().
template <class V>
WEFT_INLINE void transform_directly(const Job& job, const PowerOfTwo& scale, double* x) {
  const auto zero = get<V>(job.offset), one = get<V>(scale.first.data()),
             two = get<V>(scale.second.data());
  std::array<Complex<V>, most_direct> signal;
  std::size_t taken = 0;
  do {  // at least one
    const auto v = get<V>(job.rows + taken * step<V>) - zero;
    signal[taken] = {v.re * one.re * two.re, v.im * one.im * two.im};
  } while (++taken < job.length);
  for (std::size_t k = 0; k <= job.length / 2; ++k) {
    Complex<V> even = signal[0], odd{};
    for (std::size_t j = 1, turn = k; j < job.length; ++j) {
      even = even + signal[j] * job.root[2 * turn];
      odd = odd + signal[j] * job.root[2 * turn + 1];
      turn += k;
      if (turn >= job.length) turn -= job.length;
    }
    put(x + k * step<V>,
        Complex<V>{even.re * even.re + odd.re * odd.re, even.im * even.im + odd.im * odd.im} * 4.0);
  }
}

template <class V, class Convolve>
WEFT_INLINE void magnitudes_of(const Job& job, double* x, Convolve convolve) {
  const Scaling scaling = scaling_of(job.largest, step<V>);
  if (job.length <= most_direct) {
    transform_directly<V>(job, scaling.in, x);
    take_roots<V>(x, job.length / 2 + 1, scaling.out);
    return;
  }
  switch (job.radix) {
    case 4:
      transform_by<V, 4>(job, scaling.in, x, convolve);
      break;
    case 5:
      transform_by<V, 5>(job, scaling.in, x, convolve);
      break;
    case 6:
      transform_by<V, 6>(job, scaling.in, x, convolve);
      break;
    default:
      transform_by<V, 7>(job, scaling.in, x, convolve);
  }
  take_squares<V>(x, job.length);
  take_roots<V>(x, job.length / 2 + 1, scaling.out);
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void convolve_lanes(double* x, std::size_t size, const double* w, const double* kernel) {
  fourier::convolve<Lanes>(x, size, w, kernel, convolve_lanes);
}
void convolve_one(double* x, std::size_t size, const double* w, const double* kernel) {
  fourier::convolve<double>(x, size, w, kernel, convolve_one);
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void magnitudes_of_lanes(const Job& job, double* x) {
  magnitudes_of<Lanes>(job, x, convolve_lanes);
}
void magnitudes_of_one(const Job& job, double* x) {
  magnitudes_of<double>(job, x, convolve_one);
}

// Transform of one complex signal, in the order that the levels leave.
template <std::size_t R>
void forward_first(double* x, std::size_t part, const double* root, const double* w) {
  for (std::size_t j = 0; j < part; ++j, w += 2 * (R - 1)) {
    std::array<Complex<double>, R> in;
    for (std::size_t m = 0; m < R; ++m) in[m] = get<double>(x + (j + m * part) * step<double>);
    fourier::split_first<R>(in, root, w, x + j * step<double>, part * step<double>);
  }
}

void forward(double* x, std::size_t size, const double* w) {
  if (size == 2) fourier::split_pair<double>(x);
  if (size < 4) return;
  fourier::split<double>(x, size, w);
  const double* const next = w + size / 4 * fourier::twiddles_per_butterfly;
  for (std::size_t q = 0; q < 4; ++q) forward(x + q * size / 4 * step<double>, size / 4, next);
}

}  // namespace

Spectrum::Spectrum(std::size_t length) : length_(length) {
  if (length <= most_direct) {
    root_ = roots_of_unity(length);
    return;
  }
  std::tie(radix_, part_) = first_cut(2 * length - 1);
  twiddle_ = twiddles(radix_, part_);
  root_ = roots_of_unity(radix_);
  const std::size_t padded = radix_ * part_;
  const double scale = 1.0 / static_cast<double>(padded);
  kernel_.resize(2 * padded);
  chirp_.reserve(2 * length);
  for (std::size_t j = 0; j < length_; ++j) {
    // j^2 modulo 2 n in integers: the angle stays small and exact for any length.
    const auto square = static_cast<std::uint64_t>(j) * j % (2 * length_);
    const double angle =
        std::numbers::pi * static_cast<double>(square) / static_cast<double>(length_);
    chirp_.push_back(std::cos(angle));
    chirp_.push_back(-std::sin(angle));
    for (const std::size_t at : {j, (padded - j) % padded}) {
      kernel_[2 * at] = std::cos(angle) * scale;
      kernel_[2 * at + 1] = std::sin(angle) * scale;
    }
  }
  transform_kernel();
}

void Spectrum::transform_kernel() {
  switch (radix_) {
    case 4:
      forward_first<4>(kernel_.data(), part_, root_.data(), twiddle_.data());
      break;
    case 5:
      forward_first<5>(kernel_.data(), part_, root_.data(), twiddle_.data());
      break;
    case 6:
      forward_first<6>(kernel_.data(), part_, root_.data(), twiddle_.data());
      break;
    default:
      forward_first<7>(kernel_.data(), part_, root_.data(), twiddle_.data());
  }
  for (std::size_t q = 0; q < radix_; ++q) forward(kernel_.data() + 2 * q * part_, part_, levels());
}

template <class V>
const double* Spectrum::magnitudes(const double* rows, const double* offset, const double* largest,
                                   simd::AlignedDoubles& scratch) const {
  const std::size_t needed = std::max(bins(), radix_ * part_) * step<V>;
  if (scratch.size() < needed) scratch.resize(needed);
  const Job job{rows,         offset,          largest,  length_,       radix_,        part_,
                root_.data(), twiddle_.data(), levels(), chirp_.data(), kernel_.data()};
  if constexpr (fourier::width<V> == 1) {
    magnitudes_of_one(job, scratch.data());
  } else {
    magnitudes_of_lanes(job, scratch.data());
  }
  return scratch.data();
}

template const double* Spectrum::magnitudes<Lanes>(const double*, const double*, const double*,
                                                   simd::AlignedDoubles&) const;
template const double* Spectrum::magnitudes<double>(const double*, const double*, const double*,
                                                    simd::AlignedDoubles&) const;

const Spectrum& SpectrumCache::of(std::size_t length) {
  auto found = std::find_if(recent_.begin(), recent_.end(),
                            [=](const auto& s) { return s->length() == length; });
  if (found == recent_.end()) {
    make_room(length);
    recent_.push_back(std::make_unique<Spectrum>(length));
    found = recent_.end() - 1;
  }
  std::rotate(recent_.begin(), found, found + 1);
  return *recent_.front();
}

void SpectrumCache::make_room(std::size_t length) {
  const auto samples = [&] {
    std::size_t sum = length;
    for (const auto& s : recent_) sum += s->length();
    return sum;
  };
  while (!recent_.empty() && (recent_.size() >= most || samples() > most_samples))
    recent_.pop_back();
}

}  // namespace weft::classifier
