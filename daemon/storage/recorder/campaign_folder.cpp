#include "daemon/storage/recorder/campaign_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <system_error>
#include <utility>

#include "daemon/storage/recorder/chunk.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon {
namespace {

tl::unexpected<Error> io_error(const std::filesystem::path& where, std::string what,
                               const std::error_code& why, std::string hint = {}) {
  return fail({.code = Errc::io,
               .where = where,
               .what = std::move(what),
               .got = why.message(),
               .hint = std::move(hint)});
}

std::error_code system_error() {
  return {errno, std::generic_category()};
}

struct Descriptor {
  explicit Descriptor(int opened) : number(opened) {}
  ~Descriptor() {
    if (number >= 0) ::close(number);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number;
};

tl::unexpected<Error> cannot(const std::filesystem::path& folder, const char* what) {
  return fail({.code = Errc::unsupported,
               .where = folder.string(),
               .what = std::string("file system cannot ") + what,
               .expected = "a local disk (file locks, fsync, mmap)",
               .got = system_error().message(),
               .hint = "Record into a folder on a local disk and copy the campaign afterwards"});
}

/// The campaign file needs range locks and shared memory (for SQLite's write-ahead log).
Status check_shared_file(const std::filesystem::path& folder, int file) {
  constexpr off_t bytes = 4096;
  if (::ftruncate(file, bytes) != 0) return cannot(folder, "extend a file");
  struct flock range {};
  range.l_type = F_WRLCK;
  range.l_whence = SEEK_SET;
  range.l_len = 1;
  if (::fcntl(file, F_SETLK, &range) != 0) return cannot(folder, "lock part of a file");
  void* memory = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (memory == MAP_FAILED) return cannot(folder, "share a file between programs (mmap)");
  ::munmap(memory, bytes);
  if (::fsync(file) != 0) return cannot(folder, "write a file to the disk (fsync)");
  return {};
}

/// Checks that the file system supports everything that recording needs. A temporary file tests
/// this before the bench moves, not after the last trial.
Status check_file_system(const std::filesystem::path& folder) {
  std::string name = (folder / ".weft-try-XXXXXX").string();
  const Descriptor file(::mkostemp(name.data(), O_CLOEXEC));
  if (file.number < 0) return cannot(folder, "create a file");
  Status done = check_shared_file(folder, file.number);
  ::unlink(name.c_str());
  if (!done) return done;
  const Descriptor itself(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (::fsync(itself.number) != 0) return cannot(folder, "write a folder to the disk (fsync)");
  return {};
}

}  // namespace

// Locks the folder itself: locks on the campaign file belong to SQLite, and a lock file would be
// left behind.
Result<FolderLock> FolderLock::take(const std::filesystem::path& folder) {
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return io_error(folder, "folder cannot be opened", system_error());
  FolderLock lock(descriptor);
  if (flock(descriptor, LOCK_EX | LOCK_NB) == 0) return lock;
  if (errno != EWOULDBLOCK) return cannot(folder, "lock a folder");
  return fail({.code = Errc::busy,
               .where = folder,
               .what = "folder in use by another run",
               .hint = "Wait until that run has ended, or choose another folder"});
}

FolderLock::FolderLock(FolderLock&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)) {}

FolderLock::~FolderLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

Result<FolderLock> prepare_folder(const std::filesystem::path& folder, std::uint64_t bytes) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) return io_error(folder, "folder not created", error);
  if (::access(folder.c_str(), W_OK | X_OK) != 0)
    return io_error(folder, "folder not writable", system_error(),
                    "Choose another folder or change its permissions");
  auto lock = FolderLock::take(folder);
  if (!lock) return lock;
  if (Status able = check_file_system(folder); !able) return pass(able.error());
  if (Status room = check_space(folder, bytes); !room) return pass(room.error());
  return lock;
}

std::filesystem::path name_aside(const std::filesystem::path& file) {
  std::error_code none;
  if (!std::filesystem::exists(file, none)) return {};
  std::filesystem::path name = file;
  for (int i = 1; std::filesystem::exists(name, none); ++i)
    name.replace_filename(file.stem().string() + ".aside-" + std::to_string(i) +
                          file.extension().string());
  return name.filename();
}

Result<std::filesystem::path> set_aside(const std::filesystem::path& campaign) {
  std::filesystem::path name = name_aside(campaign);
  if (name.empty()) return name;
  {
    // Folds the log into the file, so that the rename moves everything or nothing.
    auto file = sqlite::Database::open(campaign, sqlite::Mode::read_write);
    if (!file) return pass(file.error());
    if (Status one = file->execute("PRAGMA journal_mode=DELETE"); !one)
      return pass(one.error(), campaign.string());
  }
  std::error_code error;
  std::filesystem::rename(campaign, campaign.parent_path() / name, error);
  if (error) return io_error(campaign, "file not renamed", error);
  return name;
}

std::uint64_t forecast_bytes(const RecordingForecast& forecast) {
  const auto bytes_per_s = [](double rate_hz, Stream stream, std::size_t width) {
    return rate_hz * static_cast<double>(row_bytes(stream, width));
  };
  // Four bytes per value; 20 % for the block headers.
  const double vibration_bytes_per_s =
      1.2 * 4 *
      (static_cast<double>(acceleration_axes) * forecast.acceleration_rate_hz +
       forecast.sound_rate_hz);
  const double sample_bytes =
      forecast.trials * forecast.trial_duration_s *
      (bytes_per_s(forecast.taxel_rate_hz, Stream::taxel, forecast.taxels) +
       bytes_per_s(forecast.wrench_rate_hz, Stream::wrench, 6) +
       bytes_per_s(forecast.stage_rate_hz, Stream::stages, forecast.axes) + vibration_bytes_per_s);
  // The HDF5 file is never larger than the samples. Add 10 % for catalogue, page slack and journal.
  // The write-ahead log is folded every 32 MB but grows while a reader blocks the folding.
  constexpr double fixed_bytes = 64e6;
  return static_cast<std::uint64_t>(std::ceil(2.1 * sample_bytes + fixed_bytes));
}

Status check_space(const std::filesystem::path& folder, std::uint64_t needed_bytes) {
  std::error_code error;
  const std::filesystem::space_info space = std::filesystem::space(folder, error);
  if (error) return io_error(folder, "free space unknown", error);
  if (space.available < needed_bytes)
    return fail({.code = Errc::no_space,
                 .where = folder,
                 .what = "not enough free space",
                 .expected = "at least " + std::to_string(needed_bytes) + " bytes",
                 .got = std::to_string(space.available) + " bytes",
                 .hint = "Free some space or choose another folder"});
  return {};
}

}  // namespace weft::daemon
