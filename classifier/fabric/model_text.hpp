#pragma once
// Parts of stored models as lines, bit for bit: provenance, labels, tables, one core.

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/base/line_io.hpp"
#include "classifier/base/matrix.hpp"
#include "classifier/fabric/core.hpp"
#include "classifier/learn/feature_view.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

// The first lines of every stored model: provenance and labels.

/// Origin of a model.
struct Provenance {
  std::string bench = "unknown";  ///< "simulated", "real" or "unknown"
  std::string dataset_sha256;
  std::string software_version;
  std::string training;  ///< options of the training, for readers
};

/// The word of an enumerator; `words` are in the order of the enumerators.
template <std::size_t n, class Enum>
std::string_view word_in(const std::array<std::string_view, n>& words, Enum value) {
  return words[static_cast<std::size_t>(value)];
}

/// Position of the word under `keyword`. For an unknown word `in` records a problem and the result
/// is 0.
template <std::size_t n>
std::size_t word(LineReader& in, std::string_view keyword,
                 const std::array<std::string_view, n>& words) {
  const std::string text = in.text(keyword);
  const auto found = std::find(words.begin(), words.end(), text);
  if (found != words.end()) return static_cast<std::size_t>(found - words.begin());
  in.refuse("unknown " + std::string(keyword), std::string(words.front()), text);
  return 0;
}

/// Reads a value by its name under `keyword`. Returns `otherwise` if `in` has a problem or `from`
/// does not know the name (recorded as a problem).
template <class Value>
Value read_name(LineReader& in, std::string_view keyword, Result<Value> (*from)(std::string_view),
                Value otherwise) {
  const std::string text = in.text(keyword);
  const Result<Value> value = from(text);
  if (!value) in.refuse("unknown " + std::string(keyword), value.error().expected, text);
  return value.value_or(otherwise);
}

void write_provenance(LineWriter& out, const Provenance& provenance);
/// Refuses an unknown bench kind.
Provenance read_provenance(LineReader& in);

/// Reads one name per line.
std::vector<std::string> read_names(LineReader& in, std::string_view keyword, std::size_t count);

void write_labels(LineWriter& out, const std::vector<std::string>& labels);
/// Requires at least two labels, sorted and distinct.
std::vector<std::string> read_labels(LineReader& in);

// Tables and scalers as lines of a stored model.

/// Writes one line per row.
void write_rows(LineWriter& out, std::string_view keyword, const Matrix& matrix);
/// Matrix [rows x cols]. `rows` may come from a damaged file, so memory grows only with the text.
Matrix read_rows(LineReader& in, std::string_view keyword, std::size_t rows, std::size_t cols);

/// Writes the number of rows under `keyword`, then the rows.
void write_matrix(LineWriter& out, std::string_view keyword, const Matrix& matrix);
Matrix read_matrix(LineReader& in, std::string_view keyword, std::size_t cols);

void write_scaler(LineWriter& out, const Scaler& scaler);
/// Refuses deviations that are not positive.
Scaler read_scaler(LineReader& in, std::size_t columns);

/// The lines of a core.
std::string core_text(const FabricCore& core);
/// Problems are recorded in `in`. `features`: length of a full feature vector.
FabricCore read_core(LineReader& in, std::size_t features);
/// Reads a core from its own text, for cores sent between processes. Errors: corrupt.
Result<FabricCore> core_from_text(std::string_view text, std::size_t features);

}  // namespace weft::classifier
