#pragma once
// Parts of stored models as lines, bit for bit: where a model comes from, labels, tables, one core.

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

// What every stored model says first: where it comes from; and its labels.

/// Where a model comes from.
struct Provenance {
  std::string bench = "unknown";  ///< "simulated", "real" or "unknown"
  std::string dataset_sha256;
  std::string software_version;
  std::string training;  ///< options of the training, for people
};

/// Of the words of an enumeration, in the order of its enumerators.
template <std::size_t n, class Enum>
std::string_view word_in(const std::array<std::string_view, n>& words, Enum value) {
  return words[static_cast<std::size_t>(value)];
}

/// Position of the word under `keyword`; refused where it is none of them, 0 then.
template <std::size_t n>
std::size_t word(LineReader& in, std::string_view keyword,
                 const std::array<std::string_view, n>& words) {
  const std::string text = in.text(keyword);
  const auto found = std::find(words.begin(), words.end(), text);
  if (found != words.end()) return static_cast<std::size_t>(found - words.begin());
  in.refuse("unknown " + std::string(keyword), std::string(words.front()), text);
  return 0;
}

/// A value by its name under `keyword`; `otherwise` where `in` has a problem, as with a name that
/// `from` does not know.
template <class Value>
Value read_name(LineReader& in, std::string_view keyword, Result<Value> (*from)(std::string_view),
                Value otherwise) {
  const std::string text = in.text(keyword);
  const Result<Value> value = from(text);
  if (!value) in.refuse("unknown " + std::string(keyword), value.error().expected, text);
  return value.value_or(otherwise);
}

void write_provenance(LineWriter& out, const Provenance& provenance);
/// Refuses a bench that is not known.
Provenance read_provenance(LineReader& in);

/// A line each.
std::vector<std::string> read_names(LineReader& in, std::string_view keyword, std::size_t count);

void write_labels(LineWriter& out, const std::vector<std::string>& labels);
/// Two at least, sorted, none twice.
std::vector<std::string> read_labels(LineReader& in);

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
