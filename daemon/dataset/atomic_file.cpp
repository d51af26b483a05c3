#include "daemon/dataset/atomic_file.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>

namespace weft::daemon {
namespace {

tl::unexpected<Error> system_error(std::string what, const std::filesystem::path& where) {
  return fail(Errc::io, std::move(what), where.string(), {}, std::strerror(errno));
}

/// An open file descriptor that closes itself.
class Descriptor {
 public:
  Descriptor(const std::filesystem::path& path, int flags)
      : fd_(::open(path.c_str(), flags | O_CLOEXEC, 0644)) {}
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

Status sync_folder_of(const std::filesystem::path& path) {
  return sync_folder(folder_of(path));
}

// A link stays a link: what it leads to is written.
std::filesystem::path meant(std::filesystem::path target) {
  std::error_code unseen;
  constexpr int most_links = 40;  // as the kernel's
  for (int i = 0; i < most_links && std::filesystem::is_symlink(target, unseen); ++i)
    target = target.parent_path() / std::filesystem::read_symlink(target, unseen);
  return target;
}

Status replaceable(const std::filesystem::path& target) {
  std::error_code unseen;
  const auto there = std::filesystem::status(target, unseen);
  if (!std::filesystem::exists(there) || std::filesystem::is_regular_file(there)) return {};
  return fail(Errc::io, "not a file that could be replaced", target.string(),
              "a new name, or that of a file",
              std::filesystem::is_directory(there) ? "a folder" : "a device or a pipe");
}

}  // namespace

Status check_target(const std::filesystem::path& target) {
  if (target.empty())
    return fail(Errc::invalid_argument, "no name for the output", {}, "a file", "nothing");
  const std::filesystem::path file = meant(target);
  if (auto may = replaceable(file); !may) return may;
  const std::filesystem::path folder = folder_of(file);
  std::error_code unseen;
  if (!std::filesystem::is_directory(folder, unseen))
    return fail(Errc::not_found, "no such folder to write into", target.string(), {},
                folder.string());
  if (::access(folder.c_str(), W_OK | X_OK) != 0)
    return system_error("cannot write into the folder", folder);
  return {};
}

Status sync_folder(const std::filesystem::path& folder) {
  if (const Descriptor opened(folder, O_RDONLY); opened.ok() && !opened.sync())
    return system_error("cannot bring the folder to the disk", folder);
  return {};
}

// The process number keeps two writers of the same target apart.
AtomicFile::AtomicFile(std::filesystem::path target)
    : target_(meant(std::move(target))),
      temporary_(target_.string() + ".partial-" + std::to_string(::getpid())) {}

AtomicFile::~AtomicFile() {
  std::error_code ignored;
  if (!published_) std::filesystem::remove(temporary_, ignored);
}

Status AtomicFile::publish() {
  if (Status may = replaceable(target_); !may) return may;
  if (const Descriptor file(temporary_, O_RDONLY); !file.ok() || !file.sync())
    return system_error("cannot bring the file to the disk", temporary_);
  if (std::rename(temporary_.c_str(), target_.c_str()) != 0)
    return system_error("cannot rename the finished file", target_);
  published_ = true;
  return sync_folder_of(target_);
}

Status publish_folder(const std::filesystem::path& temporary, const std::filesystem::path& target) {
  if (std::rename(temporary.c_str(), target.c_str()) != 0)
    return system_error("cannot rename the finished folder", target);
  return sync_folder_of(target);
}

Status write_text_file(const std::filesystem::path& path, std::string_view text, Readers readers) {
  AtomicFile atomic(path);
  {
    const Descriptor file(atomic.temporary(), O_WRONLY | O_CREAT | O_TRUNC);
    if (!file.ok()) return system_error("cannot create the file", path);
    if (readers == Readers::owner && !file.set_mode(0600))  // before there is anything in it
      return system_error("cannot set the file's mode", path);
    if (!file.write_all(text)) return system_error("cannot write the file", path);
  }
  return atomic.publish();
}

Status write_streamed_file(const std::filesystem::path& path,
                           const std::function<Status(std::ostream&)>& write) {
  AtomicFile atomic(path);
  {
    const Descriptor created(atomic.temporary(), O_WRONLY | O_CREAT | O_TRUNC);
    std::ofstream file(atomic.temporary(), std::ios::binary);
    if (!created.ok() || !file) return system_error("cannot create the file", path);
    errno = 0;
    const Status written = write(file);
    if (!file.flush()) return system_error("cannot write the file", path);
    if (!written) return pass(written.error(), path.string());
  }
  return atomic.publish();
}

}  // namespace weft::daemon
