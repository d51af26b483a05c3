#pragma once
// Text from outside: is it UTF-8 (RFC 3629)?

#include <cstddef>
#include <string_view>

namespace weft::daemon {

/// Bytes of the UTF-8 sequence at the start of `text`, which is not empty; 0 when it is not one.
std::size_t utf8_length(std::string_view text);
bool is_utf8(std::string_view text);

}  // namespace weft::daemon
