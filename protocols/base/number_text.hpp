#pragma once
// A number of any size in a message.

#include <array>
#include <charconv>
#include <string>

namespace weft {

/// The fewest digits that are this number: "0.25", "1e+308", of which std::to_string() has 309.
inline std::string format_number(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

}  // namespace weft
