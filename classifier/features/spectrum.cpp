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
using fourier::places;
using fourier::put;
using fourier::roots_of_unity;
using fourier::squares_of;
using fourier::step;
using fourier::times;
using fourier::twiddles;
using simd::Lanes;

constexpr std::size_t least_part = 4;    // a part of this size can be split again
constexpr std::size_t most_direct = 16;  // samples; above this a convolution of 32 is cheaper

// Radix and part of the shortest transform with at least `least` elements. It is at most a quarter
// longer.
std::pair<std::size_t, std::size_t> first_cut(std::size_t least) {
  std::pair<std::size_t, std::size_t> best{4, std::bit_ceil(std::max(4 * least_part, least)) / 4};
  for (const std::size_t radix : {5U, 6U, 7U}) {
    const std::size_t part = std::bit_ceil(std::max(least_part, (least + radix - 1) / radix));
    if (radix * part < best.first * best.second) best = {radix, part};
  }
  return best;
}

// Sixteen signals (V = Lanes) or two (double) and the tables of their length.
struct Job {
  const double* rows;
  const double* offset;
  const double* largest;
  std::size_t length, radix, part;
  const double* root;
  const double* first;   // twiddles of the first level
  const double* levels;  // twiddles of the other levels
  const double* chirp;
  const double* kernel;
  const std::uint32_t* place;  // position of each bin of a plain transform; null for a convolution
};

// Sample `at` of all signals, less offset, scaled.
template <class V>
struct Signals {
  const double* rows;
  Complex<V> zero, one, two;

  WEFT_INLINE Signals(const Job& job, const PowerOfTwo& scale)
      : rows(job.rows),
        zero(get<V>(job.offset)),
        one(get<V>(scale.first.data())),
        two(get<V>(scale.second.data())) {}
  WEFT_INLINE Complex<V> at(std::size_t i) const {
    const auto v = get<V>(rows + i * step<V>) - zero;
    return {v.re * one.re * two.re, v.im * one.im * two.im};
  }
};

// The first level of the forward transform on signals less offset, scaled, times the chirp. At most
// half of the elements, rounded up to whole parts, is signal, so zeros need not be written.
template <class V, std::size_t R>
WEFT_INLINE void split_signals(const Job& job, const PowerOfTwo& scale, double* x) {
  const Signals<V> signals(job, scale);
  const std::size_t part = job.part, length = job.length;
  const double* w = job.first;
  for (std::size_t j = 0; j < part; ++j, w += 2 * (R - 1)) {
    std::array<Complex<V>, (R + 1) / 2> in{};
    for (std::size_t m = 0, at = j; m < in.size(); ++m, at += part) {
      if (at < length) in[m] = times(signals.at(at), job.chirp + 2 * at);
    }
    fourier::split_first<R>(in, job.root, w, x + j * step<V>, part * step<V>);
  }
}

// The last level of the inverse transform times the chirp, for the half that is needed.
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

// Overwrites Z_k with the squares of 2A and 2B; no later k needs Z_k.
template <class V>
WEFT_INLINE void compute_squares(double* x, std::size_t length) {
  for (std::size_t k = 0; k <= length / 2; ++k)
    put(x + k * step<V>,
        squares_of(get<V>(x + k * step<V>), get<V>(x + (k == 0 ? 0 : length - k) * step<V>)));
}

// A transform without convolution. Its bins are in scattered order; their squares follow them.
template <class V, class Forward>
WEFT_INLINE double* transform_plainly(const Job& job, const PowerOfTwo& scale, double* x,
                                      Forward forward) {
  const Signals<V> signals(job, scale);
  const std::size_t length = job.length;
  for (std::size_t i = 0; i < length; ++i) put(x + i * step<V>, signals.at(i));
  forward(x, length, job.levels);
  double* const out = x + length * step<V>;
  for (std::size_t k = 0; k <= length / 2; ++k)
    put(out + k * step<V>, squares_of(get<V>(x + job.place[k] * step<V>),
                                      get<V>(x + job.place[(length - k) % length] * step<V>)));
  return out;
}

template <class V, std::size_t R, class Convolve>
WEFT_INLINE void transform_by(const Job& job, const PowerOfTwo& scale, double* x,
                              Convolve convolve) {
  split_signals<V, R>(job, scale, x);
  for (std::size_t q = 0; q < R; ++q)
    convolve(x + q * job.part * step<V>, job.part, job.levels, job.kernel + q * job.part * 2);
  join_signals<V, R>(job, x);
}

// Sums term by term, for the shortest signals. Gives four times the squares, as compute_squares().
template <class V>
WEFT_INLINE void transform_directly(const Job& job, const PowerOfTwo& scale, double* x) {
  const Signals<V> signals(job, scale);
  std::array<Complex<V>, most_direct> signal;
  std::size_t taken = 0;
  do {  // at least one sample
    signal[taken] = signals.at(taken);
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

// Computes magnitudes and returns their address in `x`.
template <class V, class Convolve, class Forward>
WEFT_INLINE const double* magnitudes_of(const Job& job, double* x, Convolve convolve,
                                        Forward forward) {
  const Scaling scaling = scaling_of(job.largest, step<V>);
  if (job.length <= most_direct) {
    transform_directly<V>(job, scaling.in, x);
    compute_roots<step<V>>(x, job.length / 2 + 1, scaling.out);
    return x;
  }
  if (job.place != nullptr) {
    double* const out = transform_plainly<V>(job, scaling.in, x, forward);
    compute_roots<step<V>>(out, job.length / 2 + 1, scaling.out);
    return out;
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
  compute_squares<V>(x, job.length);
  compute_roots<step<V>>(x, job.length / 2 + 1, scaling.out);
  return x;
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void convolve_lanes(double* x, std::size_t size, const double* w, const double* kernel) {
  fourier::convolve<Lanes>(x, size, w, kernel, convolve_lanes);
}
void convolve_one(double* x, std::size_t size, const double* w, const double* kernel) {
  fourier::convolve<double>(x, size, w, kernel, convolve_one);
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void forward_lanes(double* x, std::size_t size, const double* w) {
  fourier::forward<Lanes>(x, size, w, forward_lanes);
}
void forward_one(double* x, std::size_t size, const double* w) {
  fourier::forward<double>(x, size, w, forward_one);
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
const double* magnitudes_of_lanes(const Job& job, double* x) {
  return magnitudes_of<Lanes>(job, x, convolve_lanes, forward_lanes);
}
const double* magnitudes_of_one(const Job& job, double* x) {
  return magnitudes_of<double>(job, x, convolve_one, forward_one);
}

// Transform of one complex signal; the bins stay in the order of the levels.
template <std::size_t R>
void forward_first(double* x, std::size_t part, const double* root, const double* w) {
  for (std::size_t j = 0; j < part; ++j, w += 2 * (R - 1)) {
    std::array<Complex<double>, R> in;
    for (std::size_t m = 0; m < R; ++m) in[m] = get<double>(x + (j + m * part) * step<double>);
    fourier::split_first<R>(in, root, w, x + j * step<double>, part * step<double>);
  }
}

}  // namespace

Spectrum::Spectrum(std::size_t length) : length_(length) {
  if (length <= most_direct) {
    root_ = roots_of_unity(length);
    return;
  }
  if (std::has_single_bit(length)) {
    radix_ = 1;
    part_ = length;
    twiddle_ = twiddles(radix_, part_);
    place_ = places(length);
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
    // j^2 modulo 2 n in integers keeps the angle small and exact for any length.
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
  for (std::size_t q = 0; q < radix_; ++q)
    forward_one(kernel_.data() + 2 * q * part_, part_, levels());
}

template <class V>
const double* Spectrum::magnitudes(const double* rows, const double* offset, const double* largest,
                                   simd::AlignedDoubles& scratch) const {
  const std::size_t transform = std::max(bins(), radix_ * part_);
  const std::size_t needed = (place_.empty() ? transform : transform + bins()) * step<V>;
  if (scratch.size() < needed) scratch.resize(needed);
  const Job job{rows,     offset,        largest,        length_,
                radix_,   part_,         root_.data(),   twiddle_.data(),
                levels(), chirp_.data(), kernel_.data(), place_.empty() ? nullptr : place_.data()};
  if constexpr (fourier::width<V> == 1) {
    return magnitudes_of_one(job, scratch.data());
  } else {
    return magnitudes_of_lanes(job, scratch.data());
  }
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
