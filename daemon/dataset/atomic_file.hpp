#pragma once
// Output that appears whole or not at all.

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <string_view>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// A temporary name beside `target`, or beside what a link of this name leads to. Removed by the
/// destructor unless publish() has renamed it.
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path target);
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();

  /// Where to write; the writer must have closed it before publish().
  [[nodiscard]] const std::filesystem::path& temporary() const { return temporary_; }
  /// Flushes to the disk and renames over the target. Errors: io, also where the target is a
  /// folder, a device or a pipe.
  Status publish();

 private:
  std::filesystem::path target_;
  std::filesystem::path temporary_;
  bool published_ = false;
};

/// Whether an AtomicFile could be published there: for commands that work long before they write.
/// Errors: invalid_argument (no name), not_found (no such folder), io.
Status check_target(const std::filesystem::path& target);

/// Who may read what is written.
enum class Readers {
  as_umask,  ///< everybody, less what the process masks
  owner      ///< mode 0600, whatever it masks
};
/// Writes `text` to `path` through an AtomicFile.
Status write_text_file(const std::filesystem::path& path, std::string_view text,
                       Readers readers = Readers::as_umask);

/// The same of what `write` puts into a stream: for what should not be in memory twice.
Status write_streamed_file(const std::filesystem::path& path,
                           const std::function<Status(std::ostream&)>& write);

/// A rename in a folder, or a removal, is on the disk only when this has returned. Errors: io.
Status sync_folder(const std::filesystem::path& folder);

/// Renames a finished folder, whose files are on the disk, beside itself; `target` must not be
/// there. It is on the disk when this returns.
Status publish_folder(const std::filesystem::path& temporary, const std::filesystem::path& target);

}  // namespace weft::daemon
