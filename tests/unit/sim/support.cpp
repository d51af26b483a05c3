#include "tests/unit/sim/support.hpp"

#include <nlohmann/json.hpp>

namespace weft::sim::test {

std::string bench17_with(const std::vector<std::pair<std::string, std::string>>& changes) {
  auto rig = nlohmann::json::parse(bench17_text());
  for (const auto& [pointer, text] : changes)
    rig[nlohmann::json::json_pointer(pointer)] = nlohmann::json::parse(text);
  return rig.dump();
}

}  // namespace weft::sim::test
