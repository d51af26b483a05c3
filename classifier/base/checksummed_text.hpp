#pragma once
// A stored model as a whole: a first line that says what it is, its text, a last line with a
// checksum.

#include <cstddef>
#include <iosfwd>
#include <string>
#include <string_view>

#include "protocols/base/result.hpp"

namespace weft::classifier {

/// `header` and a line break, `body`, which ends with one, and the checksum of both.
std::string with_checksum(std::string_view header, std::string_view body);

/// What lies between the first `begin` bytes and the checksum of a whole file. Errors: corrupt, cut
/// short or altered.
Result<std::string_view> check_checksum(std::string_view text, std::size_t begin);

/// Whether a text that begins so is of the kind that `header`, "weft-imprint-model 1", names: of
/// whatever version.
bool is_of_kind(std::string_view beginning, std::string_view header);

/// with_checksum() to a stream. Errc::io when it fails.
Status write_checksummed(std::string_view header, std::string_view body, std::ostream& out);

/// The body of a file of exactly this `header`; `not_this` says what another file is not. Errors:
/// parse (another kind of file), unsupported (another version), corrupt (cut short or altered), io.
Result<std::string> read_checksummed(std::string_view header, std::string_view not_this,
                                     std::istream& in);

}  // namespace weft::classifier
