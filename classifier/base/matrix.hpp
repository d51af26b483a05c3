#pragma once
// A dense row-major table of doubles. The classifier's folders share only this container, so their
// headers do not include Eigen.

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <span>
#include <vector>

namespace weft::classifier {

/// [rows x cols], row-major.
class Matrix {
 public:
  Matrix() = default;
  Matrix(std::size_t rows, std::size_t cols, double value = 0.0)
      : rows_(rows), cols_(cols), data_(rows * cols, value) {}

  [[nodiscard]] std::size_t rows() const { return rows_; }
  [[nodiscard]] std::size_t cols() const { return cols_; }
  double& operator()(std::size_t r, std::size_t c) { return data_[r * cols_ + c]; }
  double operator()(std::size_t r, std::size_t c) const { return data_[r * cols_ + c]; }
  [[nodiscard]] std::span<double> row(std::size_t r) { return {data_.data() + r * cols_, cols_}; }
  [[nodiscard]] std::span<const double> row(std::size_t r) const {
    return {data_.data() + r * cols_, cols_};
  }
  [[nodiscard]] const std::vector<double>& data() const { return data_; }
  [[nodiscard]] std::span<double> data() { return data_; }

  /// Changes the size and sets every element to `value`; keeps the memory where it suffices.
  void assign(std::size_t rows, std::size_t cols, double value = 0.0) {
    rows_ = rows;
    cols_ = cols;
    data_.assign(rows * cols, value);
  }

  /// The named rows, in the given order; a row may appear twice.
  [[nodiscard]] Matrix take(std::span<const std::size_t> rows) const {
    Matrix out;
    out.rows_ = rows.size();
    out.cols_ = cols_;
    out.data_.reserve(rows.size() * cols_);
    for (const std::size_t r : rows) {
      out.data_.insert(out.data_.end(), row(r).begin(), row(r).end());
    }
    return out;
  }

 private:
  std::size_t rows_ = 0;
  std::size_t cols_ = 0;
  std::vector<double> data_;
};

/// 0, 1 ... count - 1: all rows or columns.
inline std::vector<std::size_t> numbers_below(std::size_t count) {
  std::vector<std::size_t> out(count);
  std::iota(out.begin(), out.end(), std::size_t{0});
  return out;
}

/// Index of the largest value; the lowest index of equal ones, 0 for an empty list.
template <class Values>
std::size_t place_of_largest(const Values& values) {
  return static_cast<std::size_t>(std::ranges::max_element(values) - std::ranges::begin(values));
}

}  // namespace weft::classifier
