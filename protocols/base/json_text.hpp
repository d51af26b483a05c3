#pragma once
// Parses JSON text into a document. Stricter than RFC 8259: bounded size and depth, no duplicate
// key in an object, no zero byte. All JSON that Weft reads from a person, a client or a file passes
// through it.
// Thread: any.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/result.hpp"

namespace weft {

struct JsonBounds {
  std::size_t max_bytes = std::size_t{1} << 20;  ///< longer text is refused unparsed
  std::size_t max_depth = 32;
};

/// For files that Weft wrote: the lists of a large campaign are longer than any text a person
/// writes.
inline constexpr JsonBounds any_size{static_cast<std::size_t>(-1), 64};

/// JSON pointer of a member: `parent` + "/" + `key`, with '~' and '/' escaped as in RFC 6901.
std::string child(std::string_view parent, std::string_view key);

/// Parses `text` into `document` and returns all findings; empty if the text is valid. `where` is
/// the JSON pointer. Codes: invalid_argument, a duplicate key, at its own pointer (the document has
/// the last value); range, too long or too deep; parse, all other findings, with line and column.
/// After range and parse the document is incomplete.
std::vector<Error> read_json(std::string_view text, const JsonBounds& bounds,
                             nlohmann::json& document);

/// The document. Errors: the first finding of read_json().
Result<nlohmann::json> parse_json(std::string_view text, const JsonBounds& bounds = any_size);

}  // namespace weft
