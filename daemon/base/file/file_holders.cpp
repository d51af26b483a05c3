#include "daemon/base/file/file_holders.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <set>
#include <sstream>

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;

std::set<std::string> inodes_of(const std::vector<fs::path>& files) {
  std::set<std::string> inodes;
  for (const fs::path& file : files) {
    struct stat seen {};
    if (::stat(file.c_str(), &seen) == 0) inodes.insert(std::to_string(seen.st_ino));
  }
  return inodes;
}

std::string process_text(const std::string& pid) {
  std::string name;
  std::getline(std::ifstream(fs::path("/proc") / pid / "comm"), name);
  return (name.empty() ? "a program" : name) + " (process " + pid + ")";
}

}  // namespace

// A line: "1: POSIX  ADVISORY  WRITE 71 00:2b:5678 0 EOF". The device of an overlay differs from
// the file's own, so the inode alone counts.
std::string file_holders(const std::vector<fs::path>& files) {
  const std::set<std::string> inodes = inodes_of(files);
  const std::string self = std::to_string(::getpid());
  std::set<std::string> holders;
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::istringstream words(line);
    std::string number, kind, mode, access, pid, place;
    words >> number >> kind >> mode >> access >> pid >> place;
    if (kind == "->" || pid == self) continue;  // one that waits
    const std::size_t colon = place.rfind(':');
    if (colon == std::string::npos || !inodes.contains(place.substr(colon + 1))) continue;
    holders.insert(process_text(pid));
  }
  std::string out;
  for (const std::string& holder : holders) out += (out.empty() ? "" : ", ") + holder;
  return out;
}

bool is_locked_by_another(const fs::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return false;
  const bool locked = ::flock(descriptor, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  ::close(descriptor);
  return locked;
}

}  // namespace weft::daemon
