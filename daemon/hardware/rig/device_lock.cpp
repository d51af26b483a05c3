#include "daemon/hardware/rig/device_lock.hpp"

#include <fcntl.h>
#include <netdb.h>
#include <pwd.h>
#include <sys/file.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <set>
#include <system_error>

#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/text/format.hpp"

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t longest_note = 512;

/// Numeric addresses of a host. Its name if it cannot be resolved: then it cannot be opened either.
std::set<std::string> addresses_of(const std::string& host) {
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (::getaddrinfo(host.c_str(), nullptr, &wanted, &found) != 0) return {host};
  std::set<std::string> addresses;
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    std::array<char, NI_MAXHOST> text{};
    if (::getnameinfo(one->ai_addr, one->ai_addrlen, text.data(), text.size(), nullptr, 0,
                      NI_NUMERICHOST) == 0)
      addresses.insert(text.data());
  }
  ::freeaddrinfo(found);
  return addresses.empty() ? std::set{host} : addresses;
}

/// Identical texts for two programs with the same port: "serial /dev/ttyUSB0", "tcp
/// 127.0.0.1:7101".
std::vector<std::string> ports_of(const LinkSettings& link) {
  if (const auto* serial = std::get_if<SerialSettings>(&link)) {
    std::error_code error;
    const fs::path port = fs::canonical(serial->path, error);
    return error ? std::vector<std::string>{} : std::vector{"serial " + port.string()};
  }
  const auto* tcp = std::get_if<TcpPort>(&link);
  const auto* udp = std::get_if<UdpPort>(&link);
  if (tcp == nullptr && udp == nullptr) return {};
  const Endpoint& end = tcp != nullptr ? tcp->end : udp->end;
  std::vector<std::string> ports;
  for (const std::string& address : addresses_of(end.host))
    ports.push_back((tcp != nullptr ? "tcp " : "udp ") + address + ":" + std::to_string(end.port));
  return ports;
}

/// "weft-serial%20%2Fdev%2FttyUSB0.lock"
fs::path file_name(const std::string& port) {
  std::string name = "weft-";
  for (const char c : port) {
    if (c == ' ')
      name += "%20";
    else if (c == '/')
      name += "%2F";
    else
      name += c;
  }
  return name + ".lock";
}

std::string user_name() {
  passwd entry{};
  std::array<char, 1024> text{};
  passwd* found = nullptr;
  if (::getpwuid_r(::geteuid(), &entry, text.data(), text.size(), &found) == 0 && found != nullptr)
    return found->pw_name;
  return std::to_string(::geteuid());
}

/// Opens the file, or creates it for every user. Linux refuses O_CREAT on another user's file in a
/// folder like /tmp, so an existing one is opened without it.
int open_file(const fs::path& path) {
  for (int attempt = 0; attempt < 2; ++attempt) {
    int file = ::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW);
    if (file >= 0 || errno != ENOENT) return file;
    file = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC | O_NOFOLLOW, 0666);
    if (file >= 0) ::fchmod(file, 0666);
    if (file >= 0 || errno != EEXIST) return file;
  }
  return -1;
}

/// Whether the path still names this file: its last holder may have removed it meanwhile.
bool is_current(int file, const fs::path& path) {
  struct stat opened {
  }, named{};
  return ::fstat(file, &opened) == 0 && ::stat(path.c_str(), &named) == 0 &&
         opened.st_ino == named.st_ino && opened.st_dev == named.st_dev;
}

std::string read_note(int file) {
  std::array<char, longest_note> text{};
  const ssize_t size = ::pread(file, text.data(), text.size(), 0);
  const std::string note(text.data(), size > 0 ? static_cast<std::size_t>(size) : 0);
  return note.empty() ? "another program" : note;
}

void write_note(int file, const std::string& rig) {
  const std::string note =
      std::string(program_invocation_short_name) + " (process " + std::to_string(::getpid()) +
      " of " + user_name() + ", rig " + rig + ", since " +
      utc_text(std::chrono::duration_cast<std::chrono::microseconds>(utc_now()).count()) + ")";
  // The name is only for people: if it cannot be written, the lock is still valid.
  if (::ftruncate(file, 0) == 0) static_cast<void>(!::pwrite(file, note.data(), note.size(), 0));
}

tl::unexpected<Error> cannot_lock(const fs::path& path, int number) {
  return fail({.code = Errc::io,
               .where = path.string(),
               .what = "device lock failed",
               .expected = "a file that this user can write and lock",
               .got = std::generic_category().message(number),
               .hint = number == EROFS
                           ? "Give the unit or container write access (ReadWritePaths=/run/lock)"
                           : "Make /run/lock writable for every user (mode 1777)"});
}

}  // namespace

// The same for every user: otherwise two users would lock in two folders.
fs::path DeviceLocks::default_folder() {
  constexpr const char* usual = "/run/lock";
  struct stat seen {};
  const bool is_shared = ::stat(usual, &seen) == 0 && (seen.st_mode & S_IWOTH) != 0;
  return is_shared ? usual : "/tmp";
}

DeviceLocks::~DeviceLocks() {
  for (const auto& [path, file] : files_) {
    ::unlink(path.c_str());  // refused if another user made it: then the file stays, unlocked
    ::close(file);
  }
}

Status DeviceLocks::lock(const std::string& port, const std::string& rig) {
  const fs::path path = folder_ / file_name(port);
  if (files_.contains(path)) return {};
  for (;;) {
    const int file = open_file(path);
    if (file < 0) return cannot_lock(path, errno);
    if (::flock(file, LOCK_EX | LOCK_NB) != 0) {
      const int number = errno;
      const std::string holder = read_note(file);
      ::close(file);
      if (number != EWOULDBLOCK) return cannot_lock(path, number);
      return fail({.code = Errc::busy,
                   .where = port,
                   .what = "device in use by another program",
                   .expected = "a free device",
                   .got = holder,
                   .hint = "Wait until that program ends (after a crash: until its monitor has "
                           "retracted the probe), or end it with `weft stop`"});
    }
    if (!is_current(file, path)) {
      ::close(file);
      continue;
    }
    write_note(file, rig);
    files_.emplace(path, file);
    return {};
  }
}

Status DeviceLocks::acquire(const DeviceEntry& device, const std::string& rig) {
  std::vector<std::string> ports = ports_of(device.link);
  if (device.http)
    for (std::string& port : ports_of(*device.http)) ports.push_back(std::move(port));
  for (const std::string& port : ports)
    if (Status locked = lock(port, rig); !locked) return pass(locked.error(), device.name);
  return {};
}

Status DeviceLocks::acquire(const RigFile& rig) {
  for (const DeviceEntry& device : rig.devices)
    if (Status locked = acquire(device, rig.name); !locked) return locked;
  return {};
}

std::vector<int> DeviceLocks::descriptors() const {
  std::vector<int> out;
  for (const auto& [path, file] : files_) out.push_back(file);
  return out;
}

}  // namespace weft::daemon
