#pragma once
// What every stored model says first: where it comes from; and its labels.

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "classifier/base/line_io.hpp"

namespace weft::classifier {

/// Where a model comes from.
struct Provenance {
  std::string bench = "unknown";  ///< "simulated", "real" or "unknown"
  std::string dataset_sha256;
  std::string software_version;
  std::string training;  ///< options of the training, for people
};

/// Of the words of an enumeration, in the order of its enumerators.
template <std::size_t n, class Enum>
std::string_view name_in(const std::array<std::string_view, n>& words, Enum value) {
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

void write_provenance(LineWriter& out, const Provenance& provenance);
/// Refuses a bench that is not known.
Provenance read_provenance(LineReader& in);

/// A line each.
std::vector<std::string> read_names(LineReader& in, std::string_view keyword, std::size_t count);

void write_labels(LineWriter& out, const std::vector<std::string>& labels);
/// Two at least, sorted, none twice.
std::vector<std::string> read_labels(LineReader& in);

}  // namespace weft::classifier
