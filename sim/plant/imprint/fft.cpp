#include "sim/plant/imprint/fft.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "sim/plant/lanes.hpp"

namespace weft::sim {

namespace {

constexpr std::size_t lanes = ColumnFft::lanes;

/// Rows a, b become a + b and (a - b) w.
WEFT_SIM_INLINE void split(double* re_a, double* im_a, double* re_b, double* im_b, double c,
                           double s) {
  for (std::size_t l = 0; l < lanes; l += simd::width) {
    const simd::Lanes ra = simd::load(re_a + l), ia = simd::load(im_a + l);
    const simd::Lanes rb = simd::load(re_b + l), ib = simd::load(im_b + l);
    const simd::Lanes re = ra - rb, im = ia - ib;
    simd::store(re_a + l, ra + rb);
    simd::store(im_a + l, ia + ib);
    simd::store(re_b + l, re * c - im * s);
    simd::store(im_b + l, re * s + im * c);
  }
}

/// Rows a, b become a + b w and a - b w.
WEFT_SIM_INLINE void join(double* re_a, double* im_a, double* re_b, double* im_b, double c,
                          double s) {
  for (std::size_t l = 0; l < lanes; l += simd::width) {
    const simd::Lanes ra = simd::load(re_a + l), ia = simd::load(im_a + l);
    const simd::Lanes rb = simd::load(re_b + l), ib = simd::load(im_b + l);
    const simd::Lanes re = rb * c - ib * s, im = rb * s + ib * c;
    simd::store(re_a + l, ra + re);
    simd::store(im_a + l, ia + im);
    simd::store(re_b + l, ra - re);
    simd::store(im_b + l, ia - im);
  }
}

WEFT_SIM_CLONES void run_forward(std::size_t length, const double* cosine, const double* sine,
                                 double* re, double* im) {
  for (std::size_t half = length / 2; half > 0; half /= 2)
    for (std::size_t j = 0; j < half; ++j) {
      const std::size_t turn = j * (length / 2 / half);
      for (std::size_t a = j; a < length; a += 2 * half)
        split(re + a * lanes, im + a * lanes, re + (a + half) * lanes, im + (a + half) * lanes,
              cosine[turn], -sine[turn]);
    }
}

WEFT_SIM_CLONES void run_backward(std::size_t length, const double* cosine, const double* sine,
                                  double* re, double* im) {
  for (std::size_t half = 1; half < length; half *= 2)
    for (std::size_t j = 0; j < half; ++j) {
      const std::size_t turn = j * (length / 2 / half);
      for (std::size_t a = j; a < length; a += 2 * half)
        join(re + a * lanes, im + a * lanes, re + (a + half) * lanes, im + (a + half) * lanes,
             cosine[turn], sine[turn]);
    }
}

std::size_t blocks_of(std::size_t count) {
  return (count + lanes - 1) / lanes;
}

/// Length for `count` values plus the padding that prevents wrap-around.
std::size_t padded_length(std::size_t count) {
  return std::bit_ceil(std::max<std::size_t>(2, 2 * count - 1));
}

}  // namespace

ColumnFft::ColumnFft(std::size_t length)
    : length_(length), cosine_(length / 2), sine_(length / 2), reversed_(length, 0) {
  for (std::size_t k = 0; k < length / 2; ++k) {
    const double angle =
        2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(length);
    cosine_[k] = std::cos(angle);
    sine_[k] = std::sin(angle);
  }
  for (std::size_t k = 1; k < length; ++k)
    reversed_[k] = reversed_[k / 2] / 2 + (k % 2) * (length / 2);
}

void ColumnFft::forward(double* re, double* im) const {
  run_forward(length_, cosine_.data(), sine_.data(), re, im);
}

void ColumnFft::backward(double* re, double* im) const {
  run_backward(length_, cosine_.data(), sine_.data(), re, im);
}

EvenConvolution::EvenConvolution(std::size_t rows, std::size_t cols,
                                 const std::vector<double>& kernel)
    : rows_(rows),
      cols_(cols),
      down_(padded_length(rows)),
      across_(padded_length(cols)),
      half_cols_((cols + 1) / 2),
      waves_(down_.length() / 2 + 1) {
  const std::size_t column_block = down_.length() * lanes;
  columns_re_.resize(column_block);
  columns_im_.resize(column_block);
  const std::size_t row_block = across_.length() * lanes;
  rows_re_.resize(row_block);
  rows_im_.resize(row_block);
  spectrum_re_.resize(blocks_of(waves_) * lanes * 2 * half_cols_);
  spectrum_im_.resize(spectrum_re_.size());
  kernel_.resize(blocks_of(waves_) * row_block);
  transform_columns_of(kernel);
  transform_rows_of_kernel();
}

// The kernel is even, so its transforms are real; it is wrapped around in both directions.
void EvenConvolution::transform_columns_of(const std::vector<double>& kernel) {
  for (std::size_t first = 0; first < cols_; first += lanes) {
    std::fill(columns_re_.begin(), columns_re_.end(), 0.0);
    std::fill(columns_im_.begin(), columns_im_.end(), 0.0);
    const std::size_t used = std::min(lanes, cols_ - first);
    for (std::size_t r = 0; r < rows_; ++r)
      for (std::size_t l = 0; l < used; ++l) {
        const double value = kernel[r * cols_ + first + l];
        columns_re_[r * lanes + l] = value;
        columns_re_[(down_.length() - r) % down_.length() * lanes + l] = value;
      }
    down_.forward(columns_re_.data(), columns_im_.data());
    for (std::size_t k = 0; k < waves_; ++k)
      for (std::size_t l = 0; l < used; ++l)
        spectrum_re_[at(k, first + l)] = columns_re_[down_.reversed(k) * lanes + l];
  }
}

void EvenConvolution::transform_rows_of_kernel() {
  const std::size_t length = across_.length();
  const double scale = 1 / static_cast<double>(length * down_.length());
  for (std::size_t block = 0; block < blocks_of(waves_); ++block) {
    std::fill(rows_re_.begin(), rows_re_.end(), 0.0);
    std::fill(rows_im_.begin(), rows_im_.end(), 0.0);
    for (std::size_t c = 0; c < cols_; ++c)
      for (std::size_t l = 0; l < lanes; ++l) {
        const double value = scale * spectrum_re_[at(block * lanes, c) + l];
        rows_re_[c * lanes + l] = value;
        rows_re_[(length - c) % length * lanes + l] = value;
      }
    across_.forward(rows_re_.data(), rows_im_.data());
    std::copy(rows_re_.begin(), rows_re_.end(),
              kernel_.begin() + static_cast<std::ptrdiff_t>(block * length * lanes));
  }
}

std::size_t EvenConvolution::at(std::size_t wave, std::size_t col) const {
  return (wave / lanes * 2 * half_cols_ + col) * lanes + wave % lanes;
}

// Two real columns, j and j + half, form one complex column; the symmetry of their transforms
// separates them.
void EvenConvolution::down_columns(const std::vector<double>& image, std::size_t first) {
  const std::size_t used = std::min(lanes, half_cols_ - first);
  std::fill(columns_re_.begin(), columns_re_.end(), 0.0);
  std::fill(columns_im_.begin(), columns_im_.end(), 0.0);
  for (std::size_t r = 0; r < rows_; ++r)
    for (std::size_t l = 0; l < used; ++l) {
      const std::size_t left = first + l, right = left + half_cols_;
      columns_re_[r * lanes + l] = image[r * cols_ + left];
      if (right < cols_) columns_im_[r * lanes + l] = image[r * cols_ + right];
    }
  down_.forward(columns_re_.data(), columns_im_.data());
  for (std::size_t k = 0; k < waves_; ++k) {
    const std::size_t plus = down_.reversed(k) * lanes;
    const std::size_t minus = down_.reversed((down_.length() - k) % down_.length()) * lanes;
    for (std::size_t l = 0; l < used; ++l) {
      const std::size_t left = at(k, first + l), right = at(k, first + l + half_cols_);
      spectrum_re_[left] = 0.5 * (columns_re_[plus + l] + columns_re_[minus + l]);
      spectrum_im_[left] = 0.5 * (columns_im_[plus + l] - columns_im_[minus + l]);
      spectrum_re_[right] = 0.5 * (columns_im_[plus + l] + columns_im_[minus + l]);
      spectrum_im_[right] = 0.5 * (columns_re_[minus + l] - columns_re_[plus + l]);
    }
  }
}

void EvenConvolution::along_rows(std::size_t block) {
  const std::size_t stored = 2 * half_cols_ * lanes;
  const auto used = static_cast<std::ptrdiff_t>(cols_ * lanes);
  const auto from = static_cast<std::ptrdiff_t>(block * stored);
  std::copy_n(spectrum_re_.begin() + from, used, rows_re_.begin());
  std::copy_n(spectrum_im_.begin() + from, used, rows_im_.begin());
  std::fill(rows_re_.begin() + used, rows_re_.end(), 0.0);
  std::fill(rows_im_.begin() + used, rows_im_.end(), 0.0);
  across_.forward(rows_re_.data(), rows_im_.data());
  const double* kernel = kernel_.data() + block * rows_re_.size();
  for (std::size_t i = 0; i < rows_re_.size(); ++i) {
    rows_re_[i] *= kernel[i];
    rows_im_[i] *= kernel[i];
  }
  across_.backward(rows_re_.data(), rows_im_.data());
  std::copy_n(rows_re_.begin(), used, spectrum_re_.begin() + from);
  std::copy_n(rows_im_.begin(), used, spectrum_im_.begin() + from);
}

void EvenConvolution::up_columns(std::vector<double>& out, std::size_t first) {
  const std::size_t used = std::min(lanes, half_cols_ - first);
  for (std::size_t k = 0; k < waves_; ++k) {
    const std::size_t plus = down_.reversed(k) * lanes;
    const std::size_t minus = down_.reversed((down_.length() - k) % down_.length()) * lanes;
    for (std::size_t l = 0; l < used; ++l) {
      const std::size_t left = at(k, first + l), right = at(k, first + l + half_cols_);
      columns_re_[minus + l] = spectrum_re_[left] + spectrum_im_[right];
      columns_im_[minus + l] = spectrum_re_[right] - spectrum_im_[left];
      columns_re_[plus + l] = spectrum_re_[left] - spectrum_im_[right];
      columns_im_[plus + l] = spectrum_im_[left] + spectrum_re_[right];
    }
  }
  down_.backward(columns_re_.data(), columns_im_.data());
  for (std::size_t r = 0; r < rows_; ++r)
    for (std::size_t l = 0; l < used; ++l) {
      const std::size_t left = first + l, right = left + half_cols_;
      out[r * cols_ + left] = columns_re_[r * lanes + l];
      if (right < cols_) out[r * cols_ + right] = columns_im_[r * lanes + l];
    }
}

void EvenConvolution::apply(const std::vector<double>& image, std::vector<double>& out) {
  out.resize(rows_ * cols_);
  for (std::size_t first = 0; first < half_cols_; first += lanes) down_columns(image, first);
  for (std::size_t block = 0; block < blocks_of(waves_); ++block) along_rows(block);
  for (std::size_t first = 0; first < half_cols_; first += lanes) up_columns(out, first);
}

}  // namespace weft::sim
