#include "daemon/base/file/atomic_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fstream>

namespace weft::daemon {
namespace {

constexpr const char* partial = ".partial-";
constexpr mode_t owner_only = 0600;

tl::unexpected<Error> system_error(std::string what, const std::filesystem::path& where) {
  return fail(
      {.code = Errc::io, .where = where, .what = std::move(what), .got = std::strerror(errno)});
}

/// An open file descriptor, closed at the end of its scope.
class Descriptor {
 public:
  Descriptor(const std::filesystem::path& path, int flags, mode_t mode = 0644)
      : fd_(::open(path.c_str(), flags | O_CLOEXEC, mode)) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  [[nodiscard]] bool ok() const { return fd_ >= 0; }
  [[nodiscard]] bool set_mode(mode_t mode) const { return ::fchmod(fd_, mode) == 0; }
  [[nodiscard]] bool sync() const { return ::fsync(fd_) == 0; }

  [[nodiscard]] bool write_all(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t written = ::write(fd_, text.data(), text.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) return false;
      text.remove_prefix(static_cast<std::size_t>(written));
    }
    return true;
  }

 private:
  int fd_;
};

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}

// Follows a link, so that the link stays and its target is written.
std::filesystem::path meant(std::filesystem::path target) {
  std::error_code unseen;
  constexpr int most_links = 40;  // as in the kernel
  for (int i = 0; i < most_links && std::filesystem::is_symlink(target, unseen); ++i)
    target = target.parent_path() / std::filesystem::read_symlink(target, unseen);
  return target;
}

/// The process N of "d.h5.partial-N" or of a temporary file beside it; nothing for any other name.
std::optional<pid_t> parse_writer(const std::string& name, const std::string& target) {
  const std::string prefix = target + partial;
  if (!name.starts_with(prefix)) return std::nullopt;
  const char* const end = name.data() + name.size();
  pid_t process = 0;
  const auto [stopped, error] = std::from_chars(name.data() + prefix.size(), end, process);
  const bool whole = stopped == end || std::string_view(stopped, end).starts_with(partial);
  if (error != std::errc() || !whole || process <= 0) return std::nullopt;
  return process;
}

/// Removes the temporary files of dead processes: a killed process cannot remove its own.
void remove_left_behind(const std::filesystem::path& target) {
  std::error_code unseen;
  const std::string name = target.filename().string();
  for (std::filesystem::directory_iterator at(folder_of(target), unseen), end; !unseen && at != end;
       at.increment(unseen)) {
    const auto writer = parse_writer(at->path().filename().string(), name);
    std::error_code ignored;
    if (writer && ::kill(*writer, 0) != 0 && errno == ESRCH)
      std::filesystem::remove(at->path(), ignored);
  }
}

Status replaceable(const std::filesystem::path& target) {
  std::error_code unseen;
  const auto there = std::filesystem::status(target, unseen);
  if (!std::filesystem::exists(there) || std::filesystem::is_regular_file(there)) return {};
  return fail({.code = Errc::io,
               .where = target,
               .what = "output is not a regular file",
               .expected = "a new name or an existing file",
               .got = std::filesystem::is_directory(there) ? "a folder" : "a device or a pipe"});
}

}  // namespace

Status check_target(const std::filesystem::path& target) {
  if (target.empty())
    return fail({.code = Errc::invalid_argument,
                 .what = "output name missing",
                 .expected = "a file",
                 .got = "nothing"});
  const std::filesystem::path file = meant(target);
  if (auto allowed = replaceable(file); !allowed) return allowed;
  const std::filesystem::path folder = folder_of(file);
  std::error_code unseen;
  if (!std::filesystem::is_directory(folder, unseen))
    return fail({.code = Errc::not_found,
                 .where = target,
                 .what = "output folder not found",
                 .got = folder.string()});
  if (::access(folder.c_str(), W_OK | X_OK) != 0)
    return system_error("folder not writable", folder);
  return {};
}

Status sync_folder(const std::filesystem::path& folder) {
  if (const Descriptor opened(folder, O_RDONLY); opened.ok() && !opened.sync())
    return system_error("folder not written to the disk", folder);
  return {};
}

// The process number separates two writers of the same target.
AtomicFile::AtomicFile(std::filesystem::path target, Readers readers)
    : target_(meant(std::move(target))),
      temporary_(target_.string() + partial + std::to_string(::getpid())) {
  remove_left_behind(target_);
  struct stat before {};
  if (readers == Readers::owner)
    mode_ = owner_only;
  else if (::stat(target_.c_str(), &before) == 0 && S_ISREG(before.st_mode))
    mode_ = before.st_mode & 0777U;
  if (!mode_) return;
  // The mode is set while the file is empty. If this fails, the writer's own attempt reports the
  // cause.
  const Descriptor made(temporary_, O_WRONLY | O_CREAT, owner_only);
  if (made.ok()) static_cast<void>(made.set_mode(owner_only));
}

AtomicFile::~AtomicFile() {
  std::error_code ignored;
  if (!published_) std::filesystem::remove(temporary_, ignored);
}

Status AtomicFile::publish() {
  if (Status allowed = replaceable(target_); !allowed) return allowed;
  const Descriptor file(temporary_, O_RDONLY);
  if (file.ok() && mode_ && !file.set_mode(*mode_))
    return system_error("file mode not set", target_);
  if (!file.ok() || !file.sync()) return system_error("file not written to the disk", temporary_);
  if (std::rename(temporary_.c_str(), target_.c_str()) != 0)
    return system_error("finished file not renamed", target_);
  published_ = true;
  return sync_folder(folder_of(target_));
}

Status publish_folder(const std::filesystem::path& temporary, const std::filesystem::path& target) {
  if (std::rename(temporary.c_str(), target.c_str()) != 0)
    return system_error("finished folder not renamed", target);
  return sync_folder(folder_of(target));
}

Status write_text_file(const std::filesystem::path& path, std::string_view text, Readers readers) {
  AtomicFile atomic(path, readers);
  {
    const Descriptor file(atomic.temporary(), O_WRONLY | O_CREAT | O_TRUNC);
    if (!file.ok()) return system_error("file not created", path);
    if (!file.write_all(text)) return system_error("file not written", path);
  }
  return atomic.publish();
}

Status write_streamed_file(const std::filesystem::path& path,
                           const std::function<Status(std::ostream&)>& write) {
  AtomicFile atomic(path);
  {
    const Descriptor created(atomic.temporary(), O_WRONLY | O_CREAT | O_TRUNC);
    std::ofstream file(atomic.temporary(), std::ios::binary);
    if (!created.ok() || !file) return system_error("file not created", path);
    errno = 0;
    const Status written = write(file);
    if (!file.flush()) return system_error("file not written", path);
    if (!written) return pass(written.error(), path.string());
  }
  return atomic.publish();
}

}  // namespace weft::daemon
