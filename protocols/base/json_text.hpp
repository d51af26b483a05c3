#pragma once
// JSON text to a document, stricter than RFC 8259: bounded in size and depth, no key twice in one
// object, no zero byte. Whatever Weft reads from a person, a client or a file goes through it.
// Thread: any.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft {

struct JsonBounds {
  std::size_t max_bytes = std::size_t{1} << 20;  ///< longer text is refused by its size alone
  std::size_t max_depth = 32;
};

/// Files of Weft itself: the lists of a large campaign are longer than what a person writes.
inline constexpr JsonBounds any_size{static_cast<std::size_t>(-1), 64};

/// JSON pointer of a member: `parent` + "/" + `key`, with '~' and '/' escaped as RFC 6901 asks.
std::string child(std::string_view parent, std::string_view key);

/// Parses `text` into `document` and returns all findings; none: `document` is what the text says.
/// `where` is the JSON pointer. Codes: invalid_argument, a key given twice, at its own pointer (the
/// document has the last value); range, too long or too deep; parse, everything else, with line and
/// column. After range and parse the document is incomplete.
std::vector<Error> read_json(std::string_view text, const JsonBounds& bounds,
                             nlohmann::json& document);

/// The document, or the first finding.
Result<nlohmann::json> parse_json(std::string_view text, const JsonBounds& bounds = any_size);

}  // namespace weft
