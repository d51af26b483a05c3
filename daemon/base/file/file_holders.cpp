#include "daemon/base/file/file_holders.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <set>
#include <sstream>

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;

/// Identities of files as in /proc/locks: "08:01:1234", device and inode.
std::set<std::string> places_of(const std::vector<fs::path>& files) {
  std::set<std::string> places;
  for (const fs::path& file : files) {
    struct stat seen {};
    if (::stat(file.c_str(), &seen) != 0) continue;
    std::array<char, 64> text{};
    std::snprintf(text.data(), text.size(), "%02x:%02x:%ju", major(seen.st_dev), minor(seen.st_dev),
                  static_cast<std::uintmax_t>(seen.st_ino));
    places.insert(text.data());
  }
  return places;
}

std::string inode_of(const std::string& place) {
  return place.substr(place.rfind(':') + 1);
}

std::string process_text(const std::string& pid) {
  std::string name;
  std::getline(std::ifstream(fs::path("/proc") / pid / "comm"), name);
  return (name.empty() ? "a program" : name) + " (process " + pid + ")";
}

}  // namespace

// A line: "1: POSIX  ADVISORY  WRITE 71 00:2b:5678 0 EOF". The device of an overlay differs from
// the file's own: if no identity matches, the inode alone is compared. A lock of an open file
// description has no process.
std::string file_holders(const std::vector<fs::path>& files) {
  const std::set<std::string> places = places_of(files);
  std::set<std::string> inodes;
  for (const std::string& place : places) inodes.insert(inode_of(place));
  const std::string self = std::to_string(::getpid());
  std::set<std::string> holders, by_inode;
  std::ifstream locks("/proc/locks");
  for (std::string line; std::getline(locks, line);) {
    std::istringstream words(line);
    std::string number, kind, mode, access, pid, place;
    words >> number >> kind >> mode >> access >> pid >> place;
    const bool waits = kind == "->", has_process = !pid.empty() && !pid.starts_with('-');
    if (waits || !has_process || pid == self || place.empty()) continue;
    if (places.contains(place)) holders.insert(process_text(pid));
    if (inodes.contains(inode_of(place))) by_inode.insert(process_text(pid));
  }
  if (holders.empty()) holders = std::move(by_inode);
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
