#pragma once
// Every number of a JSON document in turn replaced by what no file should hold.

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace weft::hostile {

/// As JSON text: too large, too small, denormal, beyond any double, and no number at all.
inline constexpr const char* values[] = {"1e308", "-1e308", "5e-324", "0",       "-1",
                                                 "1e30",  "1e999",  "-1e999", "\"NaN\"", "null"};

/// Calls `visit(pointer, value, document)` for every number under `root` and every hostile value.
template <class Visit>
void for_each_number(const std::string& text, const std::string& root, Visit visit) {
  const auto document = nlohmann::json::parse(text);
  const auto leaves = document.flatten();
  const std::string mark = "@hostile@";
  for (const auto& [pointer, value] : leaves.items()) {
    if (!value.is_number() || !pointer.starts_with(root)) continue;
    auto marked = document;
    marked[nlohmann::json::json_pointer(pointer)] = mark;
    const std::string changed = marked.dump();
    const std::size_t at = changed.find('"' + mark + '"');
    for (const char* hostile : values)
      visit(pointer, std::string_view(hostile),
            changed.substr(0, at) + hostile + changed.substr(at + mark.size() + 2));
  }
}

/// True where an error's place, which may stand behind the name of a file, is the field at
/// `pointer`, the list that it is in, or the object that holds both.
inline bool names_field(std::string_view where, std::string_view pointer) {
  const std::size_t slash = where.find('/');
  if (slash == std::string_view::npos || where.size() - slash < 2) return false;
  return pointer.starts_with(where.substr(slash));
}

}  // namespace weft::hostile
