#pragma once
// Whole files into memory.

#include <cstdint>
#include <filesystem>
#include <string>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// A whole file. Errors: not_found, io, range when it is larger than `max_bytes`: a huge file is
/// refused before it is read.
Result<std::string> read_file(const std::filesystem::path& path, std::uintmax_t max_bytes);
/// The same of text, such as recipes and rigs, which are small. Errors too: parse, at a zero byte.
Result<std::string> read_text_file(const std::filesystem::path& path,
                                   std::uintmax_t max_bytes = 1 << 20);

}  // namespace weft::daemon
