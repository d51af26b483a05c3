#pragma once
// The files of the page that weftd serves, built into the program: nothing is read at run time.
// Their source is daemon/service/web/page; the page has no data and requests all of it with a
// token.

#include <span>
#include <string_view>

namespace weft::daemon::web {

struct WebFile {
  std::string_view path;    ///< of the URL, "/" or "/js/api.js"
  std::string_view type;    ///< content type
  std::string_view sha256;  ///< of the bytes, hexadecimal; used as the entity tag
  std::string_view bytes;
};

/// All files, sorted by path.
std::span<const WebFile> web_files();
/// Null if there is no file of that path.
inline const WebFile* find_web_file(std::string_view path) {
  for (const WebFile& file : web_files())
    if (file.path == path) return &file;
  return nullptr;
}

}  // namespace weft::daemon::web
