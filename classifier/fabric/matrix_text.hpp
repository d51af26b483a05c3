#pragma once
// Tables and scalers as lines of a stored model.

#include <cstddef>
#include <string_view>

#include "classifier/base/line_io.hpp"
#include "classifier/base/matrix.hpp"
#include "classifier/learn/scaler.hpp"

namespace weft::classifier {

/// A line per row.
void write_rows(LineWriter& out, std::string_view keyword, const Matrix& matrix);
/// [rows x cols]. `rows` may be what a damaged file claims: memory grows with the text.
Matrix read_rows(LineReader& in, std::string_view keyword, std::size_t rows, std::size_t cols);

/// The number of rows under `keyword`, then the rows.
void write_matrix(LineWriter& out, std::string_view keyword, const Matrix& matrix);
Matrix read_matrix(LineReader& in, std::string_view keyword, std::size_t cols);

void write_scaler(LineWriter& out, const Scaler& scaler);
/// Refuses deviations that are not positive.
Scaler read_scaler(LineReader& in, std::size_t columns);

}  // namespace weft::classifier
