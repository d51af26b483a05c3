#pragma once
// Model files of older programs, and files that no reader accepts.

#include <algorithm>
#include <catch2/catch.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "classifier/base/line_io.hpp"
#include "classifier/model/model_file.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier::testing {

/// The lines of `text` that do not begin with one of these words.
inline std::string without_lines(const std::string& text, const std::vector<std::string>& words) {
  std::istringstream in(text);
  std::string out;
  for (std::string line; std::getline(in, line);)
    if (std::ranges::find(words, line.substr(0, line.find(' '))) == words.end()) out += line + "\n";
  return out;
}

/// The lines between the first line and the checksum, without those that "weft-model 1" added.
inline std::string older_body(const std::string& text) {
  return without_lines(text.substr(text.find('\n') + 1),
                       {"modality", "stages", "head_crc32", "trained_on", "digests", "crc32"});
}

/// Damage for which every stored model with a header line and a checksum is refused: an altered
/// byte after the header, a missing end, another version, another kind of file.
template <class Load>
void check_damage_is_refused(const std::string& text, const Load& load) {
  const std::size_t header_size = model_file_header.size();
  REQUIRE(text.starts_with(model_file_header));
  for (std::size_t at = header_size + 1; at < text.size(); at += 7) {
    std::string bad = text;
    bad[at] = bad[at] == 'x' ? 'y' : 'x';
    INFO("byte " << at);
    const auto model = load(bad);
    REQUIRE(!model);
    CHECK(model.error().code == Errc::corrupt);
  }
  for (const std::size_t size : {text.size() - 1, text.size() / 2, std::size_t{24}}) {
    INFO(size << " bytes");
    CHECK(!load(text.substr(0, size)));
  }
  std::string newer = text;
  newer[header_size - 1] = '9';
  CHECK(load(newer).error().code == Errc::unsupported);
  CHECK(load("weft-fabric-modes 5\n").error().code == Errc::parse);
  CHECK(load("").error().code == Errc::parse);
}

}  // namespace weft::classifier::testing
