#pragma once
// The files of the page that weftd serves, built into the program: nothing is read when it runs.
// The page itself is daemon/service/web/page; it holds no data, and asks for all of it with a
// token.

#include <span>
#include <string_view>

namespace weft::daemon::web {

struct WebFile {
  std::string_view path;    ///< of the URL, "/" or "/js/api.js"
  std::string_view type;    ///< of its content
  std::string_view sha256;  ///< hexadecimal, of the bytes; it is the entity tag
  std::string_view bytes;
};

/// All of them, by path.
std::span<const WebFile> web_files();
/// Null where there is none of that path.
inline const WebFile* find_web_file(std::string_view path) {
  for (const WebFile& file : web_files())
    if (file.path == path) return &file;
  return nullptr;
}

}  // namespace weft::daemon::web
