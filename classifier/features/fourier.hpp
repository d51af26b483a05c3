#pragma once
// Levels of a complex Fourier transform on elements that hold one signal or eight side by side.
//
// V is double (one complex signal) or simd::Lanes (eight). An element has the real parts, then the
// imaginary ones. Both kinds do the same operations in the same order: the same bits.

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "classifier/base/lanes.hpp"

namespace weft::classifier::fourier {

// Tables of the transforms.

/// Twiddles of the first level by `radix`, then of the levels by four of a part, largest first: the
/// `w` of the levels. `part` is a power of two. A radix of 1 has no first level.
simd::AlignedDoubles twiddles(std::size_t radix, std::size_t part);

/// [radix x 2]: cos and sin of 2 pi k / radix, zeros exact.
std::vector<double> roots_of_unity(std::size_t radix);

/// Position of each bin after forward() on `size` elements, a power of two.
std::vector<std::uint32_t> places(std::size_t size);

template <class V>
inline constexpr std::size_t width = simd::lanes_of<V>;
/// Doubles per element.
template <class V>
inline constexpr std::size_t step = 2 * width<V>;
/// Doubles per j of a level by four: w^j, w^2j, w^3j.
inline constexpr std::size_t twiddles_per_butterfly = 6;

template <class V>
struct Complex {
  V re, im;
};

template <class V>
WEFT_INLINE Complex<V> get(const double* element) {
  return {simd::load<V>(element), simd::load<V>(element + width<V>)};
}
template <class V>
WEFT_INLINE void put(double* element, Complex<V> v) {
  simd::store(element, v.re);
  simd::store(element + width<V>, v.im);
}

template <class V>
WEFT_INLINE Complex<V> operator+(Complex<V> a, Complex<V> b) {
  return {a.re + b.re, a.im + b.im};
}
template <class V>
WEFT_INLINE Complex<V> operator-(Complex<V> a, Complex<V> b) {
  return {a.re - b.re, a.im - b.im};
}
template <class V>
WEFT_INLINE Complex<V> operator*(Complex<V> a, double factor) {
  return {a.re * factor, a.im * factor};
}
template <class V>
WEFT_INLINE Complex<V> times_i(Complex<V> a) {
  return {-a.im, a.re};
}
// Multiplies all lanes by the same factor, given by its real and imaginary part.
template <class V>
WEFT_INLINE Complex<V> times(Complex<V> a, const double* w) {
  const V re = simd::all<V>(w[0]), im = simd::all<V>(w[1]);
  return {a.re * re - a.im * im, a.im * re + a.re * im};
}
template <class V>
WEFT_INLINE Complex<V> times_conjugate(Complex<V> a, const double* w) {
  const V re = simd::all<V>(w[0]), im = simd::all<V>(w[1]);
  return {a.re * re + a.im * im, a.im * re - a.re * im};
}

/// One butterfly of split(), in place.
template <class V>
WEFT_INLINE void split_four(Complex<V>& a, Complex<V>& b, Complex<V>& c, Complex<V>& d,
                            const double* w) {
  const auto even = a + c, odd = b + d, fall = a - c, turn = times_i(b - d);
  a = even + odd;
  b = times(fall - turn, w);
  c = times(even - odd, w + 2);
  d = times(fall + turn, w + 4);
}

/// One butterfly of join(), in place.
template <class V>
WEFT_INLINE void join_four(Complex<V>& a, Complex<V>& b, Complex<V>& c, Complex<V>& d,
                           const double* w) {
  b = times_conjugate(b, w);
  c = times_conjugate(c, w + 2);
  d = times_conjugate(d, w + 4);
  const auto even = a + c, odd = b + d, fall = a - c, turn = times_i(b - d);
  a = even + odd;
  b = fall + turn;
  c = even - odd;
  d = fall - turn;
}

/// Decimation in frequency by four: natural order in, quarters of the spectrum out.
template <class V>
WEFT_INLINE void split(double* x, std::size_t size, const double* w) {
  const std::size_t quarter = size / 4 * step<V>;
  for (double* const end = x + quarter; x < end; x += step<V>, w += twiddles_per_butterfly) {
    auto a = get<V>(x), b = get<V>(x + quarter), c = get<V>(x + 2 * quarter),
         d = get<V>(x + 3 * quarter);
    split_four(a, b, c, d, w);
    put(x, a), put(x + quarter, b), put(x + 2 * quarter, c), put(x + 3 * quarter, d);
  }
}

/// Decimation in time by four with conjugate twiddles: inverts split(), times four.
template <class V>
WEFT_INLINE void join(double* x, std::size_t size, const double* w) {
  const std::size_t quarter = size / 4 * step<V>;
  for (double* const end = x + quarter; x < end; x += step<V>, w += twiddles_per_butterfly) {
    auto a = get<V>(x), b = get<V>(x + quarter), c = get<V>(x + 2 * quarter),
         d = get<V>(x + 3 * quarter);
    join_four(a, b, c, d, w);
    put(x, a), put(x + quarter, b), put(x + 2 * quarter, c), put(x + 3 * quarter, d);
  }
}

/// Sixteen elements at distances of a sixteenth of the transform, for two levels at once.
template <class V>
struct Sixteen {
  std::array<Complex<V>, 16> at;

  WEFT_INLINE void load(const double* x, std::size_t part) {
    for (std::size_t m = 0; m < at.size(); ++m) at[m] = get<V>(x + m * part);
  }
  WEFT_INLINE void store(double* x, std::size_t part) const {
    for (std::size_t m = 0; m < at.size(); ++m) put(x + m * part, at[m]);
  }
};

/// split(), then split() of every quarter, in one pass over the memory: the same bits.
template <class V>
WEFT_INLINE void split_twice(double* x, std::size_t size, const double* w) {
  const std::size_t sixteenth = size / 16, part = sixteenth * step<V>;
  const double* inner = w + size / 4 * twiddles_per_butterfly;
  for (std::size_t j = 0; j < sixteenth; ++j, x += step<V>, inner += twiddles_per_butterfly) {
    Sixteen<V> v;
    v.load(x, part);
    for (std::size_t m = 0; m < 4; ++m)
      split_four(v.at[m], v.at[m + 4], v.at[m + 8], v.at[m + 12],
                 w + (j + m * sixteenth) * twiddles_per_butterfly);
    for (std::size_t q = 0; q < 16; q += 4)
      split_four(v.at[q], v.at[q + 1], v.at[q + 2], v.at[q + 3], inner);
    v.store(x, part);
  }
}

/// Inverts split_twice(), times sixteen.
template <class V>
WEFT_INLINE void join_twice(double* x, std::size_t size, const double* w) {
  const std::size_t sixteenth = size / 16, part = sixteenth * step<V>;
  const double* inner = w + size / 4 * twiddles_per_butterfly;
  for (std::size_t j = 0; j < sixteenth; ++j, x += step<V>, inner += twiddles_per_butterfly) {
    Sixteen<V> v;
    v.load(x, part);
    for (std::size_t q = 0; q < 16; q += 4)
      join_four(v.at[q], v.at[q + 1], v.at[q + 2], v.at[q + 3], inner);
    for (std::size_t m = 0; m < 4; ++m)
      join_four(v.at[m], v.at[m + 4], v.at[m + 8], v.at[m + 12],
                w + (j + m * sixteenth) * twiddles_per_butterfly);
    v.store(x, part);
  }
}

template <class V>
WEFT_INLINE void split_pair(double* x) {
  const auto a = get<V>(x), b = get<V>(x + step<V>);
  put(x, a + b);
  put(x + step<V>, a - b);
}

template <class V>
WEFT_INLINE void convolve_pair(double* x, const double* kernel) {
  const auto a = get<V>(x), b = get<V>(x + step<V>);
  const auto sum = times(a + b, kernel), difference = times(a - b, kernel + 2);
  put(x, sum + difference);
  put(x + step<V>, sum - difference);
}

/// Largest number of elements for the second-level cache, with room to spare (1 MiB). Longer
/// transforms do two levels in one pass, because each pass reads and writes main memory.
template <class V>
inline constexpr std::size_t most_near = (std::size_t{1} << 20) / (step<V> * sizeof(double));

/// Forward transform, product with the kernel, and inverse transform of `size` elements, a power of
/// two from four on. `deeper` completes one part after the other; it is this function for a quarter
/// or a sixteenth of the size. So all but the first levels stay in the nearest cache.
template <class V, class Deeper>
WEFT_INLINE void convolve(double* x, std::size_t size, const double* w, const double* kernel,
                          Deeper deeper) {
  const std::size_t quarter = size / 4, sixteenth = size / 16;
  if (size > most_near<V>) {
    split_twice<V>(x, size, w);
    for (std::size_t p = 0; p < size; p += sixteenth)
      deeper(x + p * step<V>, sixteenth, w + (quarter + sixteenth) * twiddles_per_butterfly,
             kernel + 2 * p);
    join_twice<V>(x, size, w);
    return;
  }
  split<V>(x, size, w);
  for (std::size_t q = 0; q < 4; ++q) {
    double* const part = x + q * quarter * step<V>;
    const double* const factors = kernel + q * quarter * 2;
    if (quarter == 1) {
      put(part, times(get<V>(part), factors));
    } else if (quarter == 2) {
      convolve_pair<V>(part, factors);
    } else {
      deeper(part, quarter, w + quarter * twiddles_per_butterfly, factors);
    }
  }
  join<V>(x, size, w);
}

/// split() of eight elements, then split_pair() of every quarter, without a store between: the same
/// bits.
template <class V>
WEFT_INLINE void split_eight(double* x, const double* w) {
  std::array<Complex<V>, 8> v;
  for (std::size_t m = 0; m < v.size(); ++m) v[m] = get<V>(x + m * step<V>);
  split_four(v[0], v[2], v[4], v[6], w);
  split_four(v[1], v[3], v[5], v[7], w + twiddles_per_butterfly);
  for (std::size_t m = 0; m < v.size(); m += 2) {
    put(x + m * step<V>, v[m] + v[m + 1]);
    put(x + (m + 1) * step<V>, v[m] - v[m + 1]);
  }
}

/// Forward transform of `size` elements, a power of two, in place. The bins stay in the order of
/// the levels: quarter q has the bins k with k mod 4 = q, and so on inside. `deeper` as for
/// convolve().
template <class V, class Deeper>
WEFT_INLINE void forward(double* x, std::size_t size, const double* w, Deeper deeper) {
  if (size == 2) split_pair<V>(x);
  if (size == 8) split_eight<V>(x, w);
  if (size < 4 || size == 8) return;
  const std::size_t quarter = size / 4, sixteenth = size / 16;
  if (quarter == 8) {
    split<V>(x, size, w);
    for (std::size_t q = 0; q < 4; ++q)
      split_eight<V>(x + q * quarter * step<V>, w + quarter * twiddles_per_butterfly);
    return;
  }
  if (size > most_near<V>) {
    split_twice<V>(x, size, w);
    for (std::size_t p = 0; p < size; p += sixteenth)
      deeper(x + p * step<V>, sixteenth, w + (quarter + sixteenth) * twiddles_per_butterfly);
    return;
  }
  split<V>(x, size, w);
  if (quarter == 1) return;
  for (std::size_t q = 0; q < 4; ++q)
    deeper(x + q * quarter * step<V>, quarter, w + quarter * twiddles_per_butterfly);
}

/// One butterfly of the first level by R, decimation in frequency. All inputs but the first M are
/// zero. Output k goes to x + k `stride`. `root` [R x 2]: cos and sin of 2 pi k / R; `w`: w^j, w^2j
/// ... w^(R-1)j.
template <std::size_t R, class V, std::size_t M>
WEFT_INLINE void split_first(const std::array<Complex<V>, M>& in, const double* root,
                             const double* w, double* x, std::size_t stride) {
  Complex<V> sum = in[0], alternating = in[0];
  for (std::size_t m = 1; m < M; ++m) {
    sum = sum + in[m];
    alternating = m % 2 == 0 ? alternating + in[m] : alternating - in[m];
  }
  put(x, sum);
  for (std::size_t k = 1; 2 * k < R; ++k) {
    Complex<V> even = in[0], odd{};
    for (std::size_t m = 1; m < M; ++m) {
      const double* const r = root + k * m % R * 2;
      even = even + in[m] * r[0];
      odd = odd + in[m] * r[1];
    }
    put(x + k * stride, times(even - times_i(odd), w + 2 * (k - 1)));
    put(x + (R - k) * stride, times(even + times_i(odd), w + 2 * (R - k - 1)));
  }
  if (R % 2 == 0) put(x + R / 2 * stride, times(alternating, w + 2 * (R / 2 - 1)));
}

/// The first M outputs of the inverse of split_first(), times R.
template <std::size_t R, std::size_t M, class V>
WEFT_INLINE std::array<Complex<V>, M> join_first(const double* x, std::size_t stride,
                                                 const double* root, const double* w) {
  std::array<Complex<V>, R> in;
  in[0] = get<V>(x);
  for (std::size_t k = 1; k < R; ++k)
    in[k] = times_conjugate(get<V>(x + k * stride), w + 2 * (k - 1));
  std::array<Complex<V>, M> out;
  for (std::size_t m = 0; m < M; ++m) {
    out[m] = in[0];
    if (R % 2 == 0) out[m] = m % 2 == 0 ? in[0] + in[R / 2] : in[0] - in[R / 2];
    Complex<V> odd{};
    for (std::size_t k = 1; 2 * k < R; ++k) {
      const double* const r = root + k * m % R * 2;
      out[m] = out[m] + (in[k] + in[R - k]) * r[0];
      odd = odd + (in[k] - in[R - k]) * r[1];
    }
    out[m] = out[m] + times_i(odd);
  }
  return out;
}

/// The squares |2A|^2 and |2B|^2 of bin k from Z_k and Z_-k. Two real signals are transformed as
/// one, Z = A + iB. A = (Z_k + conj Z_-k) / 2 and B = (Z_k - conj Z_-k) / 2i are Hermitian.
template <class V>
WEFT_INLINE Complex<V> squares_of(Complex<V> z, Complex<V> m) {
  const Complex<V> a{z.re + m.re, z.im - m.im}, b{z.re - m.re, z.im + m.im};
  return {a.re * a.re + a.im * a.im, b.re * b.re + b.im * b.im};
}

}  // namespace weft::classifier::fourier

namespace weft::classifier {

// Powers of two that scale all signals to the same level. Otherwise the rounding of a strong signal
// would hide a weak one in the same transform.

/// Two factors with the product 2^exponent. A single factor may overflow where the product with a
/// signal does not.
struct PowerOfTwo {
  alignas(64) std::array<double, simd::block_taxels> first{};
  alignas(64) std::array<double, simd::block_taxels> second{};

  void set(std::size_t k, int exponent) {
    first[k] = power(exponent / 2);
    second[k] = power(exponent - exponent / 2);
  }

 private:
  // Built from the exponent's bits: half the exponent of any double is that of a normal number.
  static double power(int exponent) {
    return std::bit_cast<double>(static_cast<std::uint64_t>(1023 + exponent) << 52);
  }
};

/// The exponent of std::frexp, read from the bits if the number is normal.
inline int exponent_of(double v) {
  const auto biased = static_cast<int>(std::bit_cast<std::uint64_t>(v) >> 52 & 0x7ff);
  if (biased != 0 && biased != 0x7ff) return biased - 1022;
  int exponent = 0;
  if (v > 0.0) std::frexp(v, &exponent);
  return exponent;
}

/// Scale factors of up to sixteen signals.
struct Scaling {
  PowerOfTwo in;  ///< scales the largest magnitude into [1/2, 1)
  PowerOfTwo
      out;  ///< inverse of `in`; zero for a silent signal, which would show its partner's rounding
};

inline Scaling scaling_of(const double* top, std::size_t signals) {
  Scaling out;
  for (std::size_t k = 0; k < signals; ++k) {
    const int exponent = exponent_of(top[k]);
    out.in.set(k, -exponent);
    out.out.set(k, exponent);
    if (top[k] == 0.0) out.out.first[k] = 0.0;
  }
  return out;
}

/// Replaces four times the squares by magnitudes, scaled back: [count x signals]. It is a loop of
/// its own over plain numbers: only then do compilers take the roots of all lanes at once, in
/// sources compiled with -fno-math-errno.
template <std::size_t signals>
WEFT_INLINE void compute_roots(double* rows, std::size_t count, const PowerOfTwo& scale) {
  PowerOfTwo by = scale;
  for (std::size_t k = 0; k < signals; ++k) by.first[k] *= 0.5;
  for (std::size_t r = 0; r < count; ++r, rows += signals) {
    for (std::size_t k = 0; k < signals; ++k)
      rows[k] = std::sqrt(rows[k]) * by.first[k] * by.second[k];
  }
}

}  // namespace weft::classifier
