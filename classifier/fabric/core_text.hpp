#pragma once
// One core as lines of a stored model, bit for bit.

#include <cstddef>
#include <string>
#include <string_view>

#include "classifier/base/line_io.hpp"
#include "classifier/base/matrix.hpp"
#include "classifier/fabric/core.hpp"
#include "classifier/learn/scaler.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

// Tables and scalers as lines of a stored model.

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

/// The lines of a core.
std::string core_text(const FabricCore& core);
/// `in` keeps the first problem. `features`: length of a full feature vector.
FabricCore read_core(LineReader& in, std::size_t features);
/// Of such a text by itself: for cores that travel between processes. Errors: corrupt.
Result<FabricCore> core_from_text(std::string_view text, std::size_t features);

}  // namespace weft::classifier
