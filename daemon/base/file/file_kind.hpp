#pragma once
// Kind of a file from its first bytes, for a person who gave it to the wrong command.

#include <filesystem>
#include <string_view>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Number of bytes that file_kind() needs.
inline constexpr std::size_t file_kind_bytes = 512;

struct FileKind {
  std::string_view name;    ///< "an HDF5 file"; empty: unknown
  std::string_view advice;  ///< the command that takes it, or how to convert it
};

/// Kind of a file that starts with `bytes`. Text that is no model of Weft has no kind.
FileKind file_kind(std::string_view bytes);

/// `error` about the file `path`, completed if the kind of the file is known. `got` is the kind,
/// `hint` the command that takes it. Reads the file's first bytes.
Error with_file_kind(Error error, const std::filesystem::path& path);

}  // namespace weft::daemon
