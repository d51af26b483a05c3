#pragma once
// A file that a client may download: what the methods hand to the transport.

#include <memory>
#include <string>
#include <string_view>

#include "daemon/base/file/read_file.hpp"

namespace weft::daemon::server {

/// Where files are: "/data/R-000318/dataset.h5".
inline constexpr std::string_view data_path = "/data/";

/// A file that somebody may have. It is what its list says; once somebody writes to it, its stamp
/// is another, and it is not.
struct ServedFile {
  std::shared_ptr<const OpenFile> file;
  OpenFile::Stamp as_of;
  std::string sha256;  ///< of its bytes; it is the entity tag
};

}  // namespace weft::daemon::server
