#include "daemon/base/file/installed_file.hpp"

namespace weft::daemon {

namespace fs = std::filesystem;

fs::path find_installed(const fs::path& relative, const fs::path& programs) {
  std::error_code unreadable;
  if (relative.is_absolute() || fs::exists(relative, unreadable)) return relative;
  const fs::path installed = programs.parent_path() / "share/weft" / relative;
  return fs::exists(installed, unreadable) ? installed : relative;
}

fs::path find_installed(const fs::path& relative) {
  std::error_code unknown;
  return find_installed(relative, fs::read_symlink("/proc/self/exe", unknown).parent_path());
}

}  // namespace weft::daemon
