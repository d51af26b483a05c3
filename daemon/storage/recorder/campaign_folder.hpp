#pragma once
// The folder of a campaign: the lock for the run that works in it, and the renaming of replaced
// files.

#include <cstdint>
#include <filesystem>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Held by at most one run at a time on this machine; released when the process dies.
class FolderLock {
 public:
  /// Errors: io; unsupported if the file system cannot lock; busy if another run works in the
  /// folder.
  static Result<FolderLock> take(const std::filesystem::path& folder);
  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&&) = delete;
  ~FolderLock();

 private:
  explicit FolderLock(int descriptor) : descriptor_(descriptor) {}
  int descriptor_;
};

/// Creates the folder and locks it. Refuses a folder that cannot be written to or has less than
/// `bytes` of free space (no_space). Also refuses a file system that cannot lock, sync or map files
/// (unsupported).
Result<FolderLock> prepare_folder(const std::filesystem::path& folder, std::uint64_t bytes);

/// The new name of a file that another file replaces in the folder ("campaign.aside-1.sqlite");
/// empty if there is no such file. Recorded data is never removed.
std::filesystem::path name_aside(const std::filesystem::path& file);
/// Folds the log into the campaign file, renames the file with name_aside(), and returns the new
/// name. Errors: io, those of SQLite.
Result<std::filesystem::path> set_aside(const std::filesystem::path& campaign);

}  // namespace weft::daemon
