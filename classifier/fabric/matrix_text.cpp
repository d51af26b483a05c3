#include "classifier/fabric/matrix_text.hpp"

#include <algorithm>

namespace weft::classifier {
namespace {

constexpr std::size_t most_rows = 100'000'000;

}  // namespace

void write_rows(LineWriter& out, std::string_view keyword, const Matrix& matrix) {
  for (std::size_t r = 0; r < matrix.rows(); ++r) out.numbers(keyword, matrix.row(r));
}

Matrix read_rows(LineReader& in, std::string_view keyword, std::size_t rows, std::size_t cols) {
  std::vector<std::vector<double>> read;
  for (std::size_t r = 0; in.ok() && r < rows; ++r) read.push_back(in.numbers(keyword, cols));
  if (!in.ok() || rows == 0) return {};
  Matrix out(rows, cols);
  for (std::size_t r = 0; r < rows; ++r)
    std::copy(read[r].begin(), read[r].end(), out.row(r).begin());
  return out;
}

void write_matrix(LineWriter& out, std::string_view keyword, const Matrix& matrix) {
  out.count(keyword, matrix.rows());
  write_rows(out, "row", matrix);
}

Matrix read_matrix(LineReader& in, std::string_view keyword, std::size_t cols) {
  return read_rows(in, "row", in.count(keyword, 0, most_rows), cols);
}

void write_scaler(LineWriter& out, const Scaler& scaler) {
  out.numbers("mean", scaler.mean);
  out.numbers("deviation", scaler.deviation);
}

Scaler read_scaler(LineReader& in, std::size_t columns) {
  Scaler scaler;
  scaler.mean = in.numbers("mean", columns);
  scaler.deviation = in.positives("deviation", columns);
  return scaler;
}

}  // namespace weft::classifier
