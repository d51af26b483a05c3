#pragma once
// JSON text to a document, stricter than the standard asks: bounded in size and depth, no key
// twice.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string_view>

#include "recipes/schema/diagnostic.hpp"

namespace weft::recipes {

struct JsonBounds {
  std::size_t max_bytes = std::size_t{1} << 20;  ///< longer text is refused by its size alone
  std::size_t max_depth = 32;
};

/// Parses `text` into `document`. Syntax errors come with line and column; NaN, Infinity and
/// numbers that no double can hold are named as such, a zero byte too. True when nothing was found
/// wrong.
bool parse_json(std::string_view text, const JsonBounds& bounds, nlohmann::json& document,
                Problems& problems);

}  // namespace weft::recipes
