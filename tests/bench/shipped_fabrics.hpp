#pragma once
// The fabrics that Weft ships, for benchmarks that run in the repository's root.

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "sim/plant/fabric.hpp"

namespace weft::bench {

/// Ends the program with a message if sim/fabrics.json is missing or invalid.
inline sim::FabricLibrary shipped_fabrics() {
  std::ifstream file("sim/fabrics.json");
  std::stringstream text;
  text << file.rdbuf();
  auto read = sim::parse_fabrics(text.str());
  if (!read) {
    std::fprintf(stderr, "%s\nRun it from the repository's root.\n",
                 to_string(read.error()).c_str());
    std::exit(1);
  }
  return *read;
}

}  // namespace weft::bench
