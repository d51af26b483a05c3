#pragma once
// Writes output that appears whole or not at all.

#include <filesystem>
#include <functional>
#include <iosfwd>
#include <optional>
#include <string_view>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// Read permission of the written file.
enum class Readers {
  as_before,  ///< as the replaced file; a new file: by the umask
  owner       ///< mode 0600, whatever mode the replaced file had
};

/// A temporary file beside `target`, or beside the target of a link of this name. The destructor
/// removes it unless publish() has renamed it. The constructor removes the temporary files that a
/// killed process of this computer left for the same target.
class AtomicFile {
 public:
  explicit AtomicFile(std::filesystem::path target, Readers readers = Readers::as_before);
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  ~AtomicFile();

  /// The path to write to; the writer must close it before publish(). With a known mode the file
  /// already exists, readable by its owner only.
  [[nodiscard]] const std::filesystem::path& temporary() const { return temporary_; }
  /// Flushes to the disk and renames over the target. Errors: io, also if the target is a folder, a
  /// device or a pipe.
  Status publish();

 private:
  std::filesystem::path target_;
  std::filesystem::path temporary_;
  std::optional<unsigned> mode_;  ///< of the published file; none: unchanged
  bool published_ = false;
};

/// Whether an AtomicFile could be published there: for commands that work for long before they
/// write. Errors: invalid_argument (no name), not_found (no such folder), io.
Status check_target(const std::filesystem::path& target);

/// Writes `text` to `path` through an AtomicFile.
Status write_text_file(const std::filesystem::path& path, std::string_view text,
                       Readers readers = Readers::as_before);

/// The same for data that `write` puts into a stream, which avoids a second copy in memory.
Status write_streamed_file(const std::filesystem::path& path,
                           const std::function<Status(std::ostream&)>& write);

/// Flushes a folder: a rename or a removal in it is on the disk only after this. Errors: io.
Status sync_folder(const std::filesystem::path& folder);

/// Renames a finished folder within its parent; its files must be on the disk, and `target` must
/// not exist. The rename is on the disk afterwards. Errors: io.
Status publish_folder(const std::filesystem::path& temporary, const std::filesystem::path& target);

}  // namespace weft::daemon
