#pragma once
// What a file is by its first bytes, for a person who gave it to the wrong command.

#include <filesystem>
#include <string_view>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// The bytes that file_kind() needs.
inline constexpr std::size_t file_kind_bytes = 512;

struct FileKind {
  std::string_view name;    ///< "an HDF5 file"; empty: none of those known
  std::string_view advice;  ///< which command takes it, or what makes a usable file of it
};

/// Of a file that begins with `bytes`. Text that is no model of Weft has no kind.
FileKind file_kind(std::string_view bytes);

/// `error` about the file `path`, with what the file is and which command takes it, where that is
/// known: `got` and `hint`. Reads the file's first bytes.
Error with_file_kind(Error error, const std::filesystem::path& path);

}  // namespace weft::daemon
