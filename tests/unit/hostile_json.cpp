#include "tests/unit/hostile_json.hpp"

#include <nlohmann/json.hpp>

namespace weft::hostile {

namespace {

constexpr const char* values[] = {"1e308", "-1e308", "5e-324", "0",       "-1",
                                  "1e30",  "1e999",  "-1e999", "\"NaN\"", "null"};

}  // namespace

void for_each_number(const std::string& text, const std::string& root, const Visit& visit) {
  const auto document = nlohmann::json::parse(text);
  const auto leaves = document.flatten();
  const std::string mark = "@hostile@";
  for (const auto& [pointer, leaf] : leaves.items()) {
    if (!leaf.is_number() || !pointer.starts_with(root)) continue;
    auto marked = document;
    marked[nlohmann::json::json_pointer(pointer)] = mark;
    const std::string changed = marked.dump();
    const std::size_t at = changed.find('"' + mark + '"');
    for (const char* value : values)
      visit(pointer, value, changed.substr(0, at) + value + changed.substr(at + mark.size() + 2));
  }
}

bool names_field(std::string_view where, std::string_view pointer) {
  const std::size_t slash = where.find('/');
  if (slash == std::string_view::npos || where.size() - slash < 2) return false;
  return pointer.starts_with(where.substr(slash));
}

}  // namespace weft::hostile
