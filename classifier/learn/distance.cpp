#include "classifier/learn/distance.hpp"

#include "classifier/learn/exponential.hpp"

namespace weft::classifier {

void add_squared_distances(const Matrix& a, const Matrix& b, std::size_t from, std::size_t to,
                           Matrix& squared) {
  std::vector<double> column(squared.cols());
  for (std::size_t k = from; k < to; ++k) {
    for (std::size_t j = 0; j < column.size(); ++j) column[j] = b(j, k);
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

void rbf(const Matrix& squared, double gamma, Matrix& out) {
  out = squared;
  exp_of_negative(out.data(), gamma);
}

Matrix rbf(const Matrix& squared, double gamma) {
  Matrix out;
  rbf(squared, gamma, out);
  return out;
}

}  // namespace weft::classifier
