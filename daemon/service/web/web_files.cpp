#include "daemon/service/web/web_files.hpp"

#include <algorithm>

namespace weft::daemon::web {

const WebFile* find_web_file(std::string_view path) {
  const auto files = web_files();
  const auto found = std::find_if(files.begin(), files.end(),
                                  [&](const WebFile& file) { return file.path == path; });
  return found == files.end() ? nullptr : &*found;
}

}  // namespace weft::daemon::web
