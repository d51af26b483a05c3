#pragma once
// Files of the repository, for tests.

#include <fstream>
#include <iterator>
#include <string>

namespace weft::testing {

/// A file of the repository: "sim/fabrics.json". Empty where there is none.
inline std::string source_text(const std::string& path) {
  std::ifstream file(std::string(WEFT_SOURCE_DIR) + "/" + path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace weft::testing
