#pragma once
// Output that appears whole or not at all.

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string_view>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Who may read what is written.
enum class Readers {
  as_before,  ///< those who may read what it replaces; a new file: everybody, as the umask has it
  owner       ///< mode 0600, whatever was there
};

/// A temporary name beside `target`, or beside what a link of this name leads to. Removed by the
/// destructor unless publish() has renamed it; what a killed process of this machine left of the
/// same target is removed by the constructor.
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path target, Readers readers = Readers::as_before);
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();

  /// Where to write; the writer must have closed it before publish(). It is there, for its owner
  /// alone, where who may read the target is settled.
  [[nodiscard]] const std::filesystem::path& temporary() const { return temporary_; }
  /// Flushes to the disk and renames over the target. Errors: io, also where the target is a
  /// folder, a device or a pipe.
  Status publish();

 private:
  std::filesystem::path target_;
  std::filesystem::path temporary_;
  std::optional<unsigned> mode_;  ///< of the published file; none: as it was made
  bool published_ = false;
};

/// Whether an AtomicFile could be published there: for commands that work long before they write.
/// Errors: invalid_argument (no name), not_found (no such folder), io.
Status check_target(const std::filesystem::path& target);

/// Writes `text` to `path` through an AtomicFile.
Status write_text_file(const std::filesystem::path& path, std::string_view text,
                       Readers readers = Readers::as_before);

/// The same of what `write` puts into a stream: for what should not be in memory twice.
Status write_streamed_file(const std::filesystem::path& path,
                           const std::function<Status(std::ostream&)>& write);

/// A rename in a folder, or a removal, is on the disk only when this has returned. Errors: io.
Status sync_folder(const std::filesystem::path& folder);

/// Renames a finished folder, whose files are on the disk, beside itself; `target` must not be
/// there. It is on the disk when this returns.
Status publish_folder(const std::filesystem::path& temporary, const std::filesystem::path& target);

}  // namespace weft::daemon
