#pragma once
// Golden vectors: protocols/<wire>/vectors/*.json, each with the source of its bytes.

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/unit/hex.hpp"

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

}  // namespace weft::testing
