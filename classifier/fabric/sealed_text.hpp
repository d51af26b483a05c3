#pragma once
// A stored model as a whole: a first line that says what it is, its text, a last line with a
// checksum.

#include <cstddef>
#include <string>
#include <string_view>

#include "protocols/base/result.hpp"

namespace weft::classifier {

/// `header` and a line break, `body`, which ends with one, and the checksum of both.
std::string sealed(std::string_view header, std::string_view body);

/// What lies between the first `begin` bytes and the checksum of a whole file. Errors: corrupt, cut
/// short or altered.
Result<std::string_view> unsealed(std::string_view text, std::size_t begin);

}  // namespace weft::classifier
