// Runs one engine and prints its results as JSON.

#include <cstdio>
#include <string>

#include "tests/bench/peers/scenes.hpp"

namespace {

using weft::bench::peers::Run;

std::string json_of(const std::vector<Run>& runs) {
  std::string out;
  for (const Run& run : runs) {
    char numbers[160];
    std::snprintf(numbers, sizeof numbers,
                  "\"step_s\": %.9g, \"cpu_per_s\": %.9g, \"failed\": %s, \"error\": ", run.step_s,
                  run.cpu_per_s, run.failed ? "true" : "false");
    char value[32];
    std::snprintf(value, sizeof value, "%.9g", run.error);
    out += std::string(out.empty() ? "" : ", ") + "{\"setting\": \"" + run.setting + "\", " +
           numbers + (std::isfinite(run.error) ? value : "null") + "}";
  }
  return "[" + out + "]";
}

}  // namespace

int main() {
  const auto engine = weft::bench::peers::engine({}, {});
  std::printf("{\"name\": \"%s\", \"press\": %s, \"slide\": %s}\n", engine.name.c_str(),
              json_of(engine.press).c_str(), json_of(engine.slide).c_str());
}
