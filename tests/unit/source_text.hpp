#pragma once
// Files of the repository, for tests.

#include <fstream>
#include <iterator>
#include <string>

namespace weft::testing {

/// A file of the repository, such as "sim/fabrics.json"; empty if it does not exist.
inline std::string source_text(const std::string& path) {
  std::ifstream file(std::string(WEFT_SOURCE_DIR) + "/" + path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace weft::testing
