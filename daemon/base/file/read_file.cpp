#include "daemon/base/file/read_file.hpp"

#include <fcntl.h>
#include <linux/openat2.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <utility>

namespace weft::daemon {

Result<std::string> read_text_file(const std::filesystem::path& path, std::uintmax_t max_bytes) {
  auto text = read_file(path, max_bytes);
  // Parsers of JSON take a zero byte for the end of the text and ignore the rest.
  if (text && text->find('\0') != std::string::npos)
    return fail({.code = Errc::parse, .where = path, .what = "zero byte in a text file"});
  return text;
}

Result<std::string> read_file(const std::filesystem::path& path, std::uintmax_t max_bytes) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error)
    return fail({.code = Errc::not_found,
                 .where = path,
                 .what = "file not readable",
                 .got = error.message()});
  if (size > max_bytes)
    return fail({.code = Errc::range,
                 .where = path,
                 .what = "file too large",
                 .expected = "at most " + std::to_string(max_bytes) + " bytes",
                 .got = std::to_string(size) + " bytes"});
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) return fail({.code = Errc::io, .where = path, .what = "file not readable"});
  return std::move(text).str();
}

namespace {

namespace fs = std::filesystem;

// Non-blocking: opening a pipe must not wait for its other end.
constexpr int reading = O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY;
constexpr int passing = O_PATH | O_CLOEXEC | O_NOFOLLOW | O_DIRECTORY;

int open_at_once(int folder, const fs::path& inner) {
  open_how how{};
  how.flags = reading;
  how.resolve = RESOLVE_BENEATH | RESOLVE_NO_SYMLINKS | RESOLVE_NO_MAGICLINKS;
  return static_cast<int>(syscall(SYS_openat2, folder, inner.c_str(), &how, sizeof how));
}

/// Opens each part in the folder before it; no part may be a link.
int open_step_by_step(int folder, const fs::path& inner) {
  int at = folder;
  for (auto part = inner.begin(); part != inner.end(); ++part) {
    const bool last = std::next(part) == inner.end();
    const bool plain = !part->empty() && *part != "." && *part != ".." && !part->is_absolute();
    errno = EXDEV;
    const int next = plain ? openat(at, part->c_str(), last ? reading : passing) : -1;
    const int why = errno;
    if (at != folder) close(at);
    errno = why;
    if (next < 0) return -1;
    at = next;
  }
  return at;
}

tl::unexpected<Error> not_opened(const fs::path& inner, int why) {
  if (why == ENOENT || why == ENOTDIR)
    return fail({.code = Errc::not_found, .where = inner.string(), .what = "no such file"});
  if (why == ELOOP || why == EXDEV)
    return fail({.code = Errc::wrong_state,
                 .where = inner.string(),
                 .what = "symbolic link in the path of the file",
                 .expected = "a regular file in its own folder"});
  return fail({.code = Errc::io,
               .where = inner.string(),
               .what = "file cannot be opened",
               .got = std::strerror(why)});
}

}  // namespace

Result<OpenFile> OpenFile::beneath(const fs::path& folder, const fs::path& inner, Way way) {
  const int base = open(folder.c_str(), O_PATH | O_CLOEXEC | O_DIRECTORY);
  if (base < 0)
    return fail({.code = Errc::not_found, .where = folder.string(), .what = "no such folder"});
  int found = -1;
  if (way == Way::at_once) found = open_at_once(base, inner);
  // The kernel is older, or a filter of system calls does not know the call.
  if (way == Way::step_by_step || (found < 0 && (errno == ENOSYS || errno == EPERM)))
    found = open_step_by_step(base, inner);
  const int why = errno;
  close(base);
  if (found < 0) return not_opened(inner, why);
  OpenFile file(found);
  struct stat facts {};
  if (fstat(found, &facts) != 0 || !S_ISREG(facts.st_mode))
    return fail({.code = Errc::wrong_state, .where = inner.string(), .what = "not a regular file"});
  return file;
}

OpenFile::OpenFile(OpenFile&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}

OpenFile::~OpenFile() {
  if (descriptor_ >= 0) close(descriptor_);
}

Result<OpenFile::Stamp> OpenFile::stamp() const {
  struct stat facts {};
  if (fstat(descriptor_, &facts) != 0)
    return fail(
        {.code = Errc::io, .what = "file status not readable", .got = std::strerror(errno)});
  const auto ns = [](const timespec& at) {
    return std::int64_t{at.tv_sec} * 1'000'000'000 + at.tv_nsec;
  };
  return Stamp{facts.st_dev, facts.st_ino, static_cast<std::uint64_t>(facts.st_size),
               ns(facts.st_mtim), ns(facts.st_ctim)};
}

Status OpenFile::read(std::uint64_t at, std::span<std::uint8_t> to) const {
  while (!to.empty()) {
    const ssize_t got = pread(descriptor_, to.data(), to.size(), static_cast<off_t>(at));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0)
      return fail({.code = Errc::io,
                   .what = "file not readable to its end",
                   .got = got < 0 ? std::strerror(errno) : ""});
    at += static_cast<std::uint64_t>(got);
    to = to.subspan(static_cast<std::size_t>(got));
  }
  return {};
}

}  // namespace weft::daemon
