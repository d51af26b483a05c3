#include "classifier/learn/distance.hpp"

#include <cmath>

namespace weft::classifier {

void add_squared_distances(const Matrix& a, const Matrix& b, std::size_t from, std::size_t to,
                           Matrix& squared) {
  std::vector<double> column(b.rows());
  for (std::size_t k = from; k < to; ++k) {
    for (std::size_t j = 0; j < b.rows(); ++j) column[j] = b(j, k);
    for (std::size_t i = 0; i < a.rows(); ++i) {
      const double v = a(i, k);
      double* out = squared.row(i).data();
      for (std::size_t j = 0; j < column.size(); ++j) {
        const double d = v - column[j];
        out[j] += d * d;
      }
    }
  }
}

Matrix rbf(const Matrix& squared, double gamma) {
  Matrix out(squared.rows(), squared.cols());
  for (std::size_t i = 0; i < squared.rows(); ++i) {
    for (std::size_t j = 0; j < squared.cols(); ++j) out(i, j) = std::exp(-gamma * squared(i, j));
  }
  return out;
}

}  // namespace weft::classifier
