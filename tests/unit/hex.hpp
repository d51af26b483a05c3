#pragma once
// Bytes in the notation of the documents.

#include <cstdint>
#include <sstream>
#include <string>

#include "protocols/base/bytes.hpp"

namespace weft::testing {

/// "0A ff 10" to bytes.
inline Bytes hex(const std::string& text) {
  Bytes bytes;
  std::istringstream words(text);
  for (std::string word; words >> word;)
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(word, nullptr, 16)));
  return bytes;
}

}  // namespace weft::testing
