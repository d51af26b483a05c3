#include "classifier/features/spectrum.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

namespace weft::classifier {
namespace {

// The exponent e with max|v| in [2^(e-1), 2^e), 0 for a signal of zeros.
int exponent_of(std::span<const double> v) {
  double top = 0.0;
  for (const double x : v) top = std::max(top, std::abs(x));
  int exponent = 0;
  std::frexp(top, &exponent);
  return exponent;
}

bool silent(std::span<const double> v) {
  return std::all_of(v.begin(), v.end(), [](double x) { return x == 0.0; });
}

void load_scaled(std::span<const double> v, int exponent, std::vector<double>& out) {
  for (std::size_t i = 0; i < v.size(); ++i) out[i] = std::ldexp(v[i], -exponent);
}

}  // namespace

Spectrum::Spectrum(std::size_t length)
    : length_(length), padded_(std::bit_ceil(std::max<std::size_t>(1, 2 * length))) {
  for (std::size_t half = padded_ / 2; half >= 1; half /= 2) {
    for (std::size_t j = 0; j < half; ++j) {
      const double angle = -std::numbers::pi * static_cast<double>(j) / static_cast<double>(half);
      twiddle_re_.push_back(std::cos(angle));
      twiddle_im_.push_back(std::sin(angle));
    }
  }
  kernel_re_.assign(padded_, 0.0);
  kernel_im_.assign(padded_, 0.0);
  const double scale = 1.0 / static_cast<double>(padded_);
  for (std::size_t j = 0; j < length_; ++j) {
    // j^2 modulo 2 n in integers: the angle stays small and exact for any length.
    const auto square = static_cast<std::uint64_t>(j) * j % (2 * length_);
    const double angle =
        std::numbers::pi * static_cast<double>(square) / static_cast<double>(length_);
    chirp_re_.push_back(std::cos(angle));
    chirp_im_.push_back(-std::sin(angle));
    kernel_re_[j] = std::cos(angle) * scale;
    kernel_im_[j] = std::sin(angle) * scale;
    kernel_re_[(padded_ - j) % padded_] = kernel_re_[j];
    kernel_im_[(padded_ - j) % padded_] = kernel_im_[j];
  }
  forward(kernel_re_, kernel_im_);
  work_re_.resize(padded_);
  work_im_.resize(padded_);
}

// Decimation in frequency: natural order in, bit-reversed order out. The product in between does
// not mind the order, and the inverse takes it back, so no reordering pass is needed.
void Spectrum::forward(std::vector<double>& re, std::vector<double>& im) const {
  const double* wr = twiddle_re_.data();
  const double* wi = twiddle_im_.data();
  for (std::size_t half = padded_ / 2; half >= 1; half /= 2) {
    for (std::size_t start = 0; start < padded_; start += 2 * half) {
      double* ar = re.data() + start;
      double* ai = im.data() + start;
      double* br = ar + half;
      double* bi = ai + half;
      for (std::size_t j = 0; j < half; ++j) {
        const double dr = ar[j] - br[j];
        const double di = ai[j] - bi[j];
        ar[j] += br[j];
        ai[j] += bi[j];
        br[j] = dr * wr[j] - di * wi[j];
        bi[j] = dr * wi[j] + di * wr[j];
      }
    }
    wr += half;
    wi += half;
  }
}

// Decimation in time with conjugate twiddles: bit-reversed in, natural out; the 1/padded is in the
// kernel.
void Spectrum::inverse(std::vector<double>& re, std::vector<double>& im) const {
  const double* wr = twiddle_re_.data() + twiddle_re_.size();
  const double* wi = twiddle_im_.data() + twiddle_im_.size();
  for (std::size_t half = 1; half < padded_; half *= 2) {
    wr -= half;
    wi -= half;
    for (std::size_t start = 0; start < padded_; start += 2 * half) {
      double* ar = re.data() + start;
      double* ai = im.data() + start;
      double* br = ar + half;
      double* bi = ai + half;
      for (std::size_t j = 0; j < half; ++j) {
        const double tr = br[j] * wr[j] + bi[j] * wi[j];
        const double ti = bi[j] * wr[j] - br[j] * wi[j];
        br[j] = ar[j] - tr;
        bi[j] = ai[j] - ti;
        ar[j] += tr;
        ai[j] += ti;
      }
    }
  }
}

// In: work_ holds `length_` complex samples. Out: their transform, up to a factor of modulus 1 per
// bin (the last chirp), which magnitudes() applies because it mixes bins.
void Spectrum::transform() {
  for (std::size_t j = 0; j < length_; ++j) {
    const double re = work_re_[j] * chirp_re_[j] - work_im_[j] * chirp_im_[j];
    work_im_[j] = work_re_[j] * chirp_im_[j] + work_im_[j] * chirp_re_[j];
    work_re_[j] = re;
  }
  const auto tail = static_cast<std::ptrdiff_t>(length_);
  std::fill(work_re_.begin() + tail, work_re_.end(), 0.0);
  std::fill(work_im_.begin() + tail, work_im_.end(), 0.0);
  forward(work_re_, work_im_);
  for (std::size_t j = 0; j < padded_; ++j) {
    const double re = work_re_[j] * kernel_re_[j] - work_im_[j] * kernel_im_[j];
    work_im_[j] = work_re_[j] * kernel_im_[j] + work_im_[j] * kernel_re_[j];
    work_re_[j] = re;
  }
  inverse(work_re_, work_im_);
  for (std::size_t j = 0; j < length_; ++j) {
    const double re = work_re_[j] * chirp_re_[j] - work_im_[j] * chirp_im_[j];
    work_im_[j] = work_re_[j] * chirp_im_[j] + work_im_[j] * chirp_re_[j];
    work_re_[j] = re;
  }
}

void Spectrum::magnitudes(std::span<const double> a, std::span<const double> b,
                          std::span<double> out_a, std::span<double> out_b) {
  if (length_ == 0) {
    out_a[0] = out_b[0] = 0.0;
    return;
  }
  const int exponent_a = exponent_of(a);
  const int exponent_b = exponent_of(b);
  load_scaled(a, exponent_a, work_re_);
  load_scaled(b, exponent_b, work_im_);
  transform();
  for (std::size_t k = 0; k < bins(); ++k) {
    const std::size_t mirror = (length_ - k) % length_;
    // Z = A + iB with A, B Hermitian: A = (Z_k + conj Z_-k) / 2, B = (Z_k - conj Z_-k) / 2i.
    const double sr = work_re_[k] + work_re_[mirror];
    const double si = work_im_[k] - work_im_[mirror];
    const double dr = work_re_[k] - work_re_[mirror];
    const double di = work_im_[k] + work_im_[mirror];
    out_a[k] = std::ldexp(0.5 * std::sqrt(sr * sr + si * si), exponent_a);
    out_b[k] = std::ldexp(0.5 * std::sqrt(dr * dr + di * di), exponent_b);
  }
  // What a silent signal shows beside a live one is the live one's rounding.
  if (silent(a)) std::fill(out_a.begin(), out_a.end(), 0.0);
  if (silent(b)) std::fill(out_b.begin(), out_b.end(), 0.0);
}

}  // namespace weft::classifier
