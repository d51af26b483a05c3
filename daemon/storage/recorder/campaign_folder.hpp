#pragma once
// The folder of a campaign: which run may work in it, and what becomes of a file that is replaced.

#include <cstdint>
#include <filesystem>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Held by at most one run at a time on this machine; a process that dies lets go of it.
class FolderLock {
 public:
  /// Errors: io; wrong_state, when another run works in the folder.
  static Result<FolderLock> take(const std::filesystem::path& folder);
  FolderLock(FolderLock&& other) noexcept;
  FolderLock& operator=(FolderLock&&) = delete;
  ~FolderLock();

 private:
  explicit FolderLock(int descriptor) : descriptor_(descriptor) {}
  int descriptor_;
};

/// Makes the folder and takes it; refuses one that cannot be written to, lacks room for `bytes`, or
/// lies on a file system that cannot lock, sync or map files (unsupported).
Result<FolderLock> prepare_folder(const std::filesystem::path& folder, std::uint64_t bytes);

/// What a file is called once another takes its place in the folder ("campaign.aside-1.sqlite");
/// empty where there is none. Nothing that was recorded is ever removed.
std::filesystem::path name_aside(const std::filesystem::path& file);
/// Renames a campaign file so, its log folded in, and returns the name. Errors: io, those of
/// SQLite.
Result<std::filesystem::path> set_aside(const std::filesystem::path& campaign);

}  // namespace weft::daemon
