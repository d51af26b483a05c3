#pragma once
// Fourier transforms of many short columns at once, and the two-dimensional convolution of the
// half-space: real data with a real, even kernel. Radix 2 in the order of the butterflies (forward
// natural to bit-reversed, backward the reverse), so that no reordering is needed.

#include <cstddef>
#include <vector>

namespace weft::sim {

/// `lanes` transforms of one length at once; row k of re and im holds element k of each.
class ColumnFft {
 public:
  static constexpr std::size_t lanes = 8;

  /// `length` is a power of two.
  explicit ColumnFft(std::size_t length);

  /// sum_n z[n] e^{-2 pi i k n / length} is in row reversed(k) afterwards.
  void forward(double* re, double* im) const;
  /// Input rows are in reversed order, output rows in natural order, times `length`.
  void backward(double* re, double* im) const;
  [[nodiscard]] std::size_t length() const { return length_; }
  [[nodiscard]] std::size_t reversed(std::size_t k) const { return reversed_[k]; }

 private:
  std::size_t length_;
  std::vector<double> cosine_, sine_;  // of 2 pi k / length, k < length/2
  std::vector<std::size_t> reversed_;
};

/// Convolution of rows x cols images with one kernel that is real and even along both axes,
/// without wrap-around.
class EvenConvolution {
 public:
  /// kernel(r, c) for 0 <= r < rows, 0 <= c < cols, row by row: the influence at that distance.
  EvenConvolution(std::size_t rows, std::size_t cols, const std::vector<double>& kernel);

  /// out[r, c] = sum kernel(|r - i|, |c - j|) image[i, j]. Thread: one at a time, because it uses
  /// internal memory.
  void apply(const std::vector<double>& image, std::vector<double>& out);

 private:
  void transform_columns_of(const std::vector<double>& kernel);
  void transform_rows_of_kernel();
  void down_columns(const std::vector<double>& image, std::size_t first);
  void along_rows(std::size_t block);
  void up_columns(std::vector<double>& out, std::size_t first);
  [[nodiscard]] std::size_t at(std::size_t wave, std::size_t col) const;

  std::size_t rows_, cols_;
  ColumnFft down_, across_;
  std::size_t half_cols_;                          // pairs of real columns
  std::size_t waves_;                              // distinct frequencies of a real column
  std::vector<double> kernel_;                     // its transform, in the order of along_rows
  std::vector<double> spectrum_re_, spectrum_im_;  // of all columns: blocks of 8 waves, columns, 8
  std::vector<double> columns_re_, columns_im_;    // one block of 8 column pairs
  std::vector<double> rows_re_, rows_im_;          // one block of 8 waves, across the columns
};

}  // namespace weft::sim
