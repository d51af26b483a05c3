#pragma once
// Makes external text safe for a message.

#include <algorithm>
#include <cstddef>
#include <string>
#include <string_view>

namespace weft {

/// The first line of `text`, at most `most` bytes; other bytes than printable ASCII become '?'.
inline std::string printable(std::string_view text, std::size_t most = 40) {
  std::string line(text.substr(0, std::min(text.find_first_of("\r\n"), most)));
  std::replace_if(
      line.begin(), line.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return line;
}

}  // namespace weft
