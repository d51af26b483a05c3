#pragma once
// A model file with a correct checksum, so that mutations reach the parser of its lines.

#include <cstdio>
#include <string>
#include <string_view>

#include "protocols/base/bytes.hpp"

namespace weft::fuzz {

inline std::string with_checksum(std::string_view text) {
  const std::size_t trailer = text.rfind("crc32 ");
  const std::string body(text.substr(0, trailer));
  char line[16];
  std::snprintf(line, sizeof line, "crc32 %08x",
                crc32({reinterpret_cast<const std::uint8_t*>(body.data()), body.size()}));
  return body + line + "\n";
}

}  // namespace weft::fuzz
