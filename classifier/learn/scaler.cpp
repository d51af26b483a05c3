#include "classifier/learn/scaler.hpp"

#include <algorithm>
#include <cmath>

namespace weft::classifier {
namespace {

// A spread of rounding only must not be blown up to unit variance, nor beyond it.
constexpr double constant_unit = 1e-9;

void fit_column(const Matrix& rows, std::size_t k, Scaler& out) {
  const auto n = static_cast<double>(rows.rows());
  double top = 0.0;
  for (std::size_t r = 0; r < rows.rows(); ++r) top = std::max(top, std::abs(rows(r, k)));
  const double unit = top > 0.0 ? top : 1.0;  // squares of values up to 1e300 must not overflow
  double sum = 0.0;
  for (std::size_t r = 0; r < rows.rows(); ++r) sum += rows(r, k) / unit;
  const double mean = sum / n;
  double square = 0.0;
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    const double d = rows(r, k) / unit - mean;
    square += d * d;
  }
  const double deviation = std::sqrt(square / n);
  out.mean[k] = mean * unit;
  const double spread = deviation > rounding_spread ? deviation * unit : 0.0;
  out.deviation[k] = spread > 0.0 ? spread : std::max(1.0, constant_unit * top);
}

}  // namespace

Scaler fit_scaler(const Matrix& rows) {
  Scaler out{std::vector<double>(rows.cols()), std::vector<double>(rows.cols())};
  for (std::size_t k = 0; k < rows.cols(); ++k) fit_column(rows, k, out);
  return out;
}

Matrix scaled(const Scaler& scaler, const Matrix& rows) {
  Matrix out(rows.rows(), rows.cols());
  for (std::size_t r = 0; r < rows.rows(); ++r) {
    for (std::size_t k = 0; k < rows.cols(); ++k) out(r, k) = scaler.apply(k, rows(r, k));
  }
  return out;
}

}  // namespace weft::classifier
