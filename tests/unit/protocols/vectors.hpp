#pragma once
// Golden vectors: protocols/<wire>/vectors/*.json, each with the source of its bytes.

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "protocols/base/bytes.hpp"

namespace weft::testing {

struct Vector {
  std::string name;
  std::string text;  ///< the JSON, which the tests parse
};

inline std::vector<Vector> load_vectors(const std::string& wire) {
  std::vector<Vector> out;
  const std::filesystem::path folder =
      std::filesystem::path(WEFT_SOURCE_DIR) / "protocols" / wire / "vectors";
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::ifstream file(entry.path());
    out.push_back(
        {entry.path().stem().string(), std::string(std::istreambuf_iterator<char>(file), {})});
  }
  return out;
}

/// "0A ff 10" to bytes.
inline Bytes from_hex(const std::string& text) {
  Bytes out;
  for (std::size_t i = 0; i + 1 < text.size(); i += 3)
    out.push_back(static_cast<std::uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
  return out;
}

}  // namespace weft::testing
