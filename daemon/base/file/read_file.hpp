#pragma once
// Reads files: whole into memory, or in parts from a file that stays the same.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>

#include "protocols/base/result.hpp"

namespace weft::daemon {

/// A file of a folder, opened once: the checked file is the one that is read, even if its name now
/// leads elsewhere.
class OpenFile {
 public:
  /// Identity and state of a file. Each write to a file changes its `changed_ns`, which no program
  /// can set.
  struct Stamp {
    std::uint64_t device = 0, inode = 0, bytes = 0;
    std::int64_t written_ns = 0, changed_ns = 0;  ///< since 1970-01-01 UTC
    bool operator==(const Stamp&) const = default;
  };
  /// Kernel interface: at once (openat2, Linux 5.6), or one folder after the other.
  enum class Way { at_once, step_by_step };

  /// `inner`, a relative path, under `folder`; no part of it may be a symbolic link or lead out.
  /// Errors: not_found; wrong_state if it is no regular file or has a link on the way.
  static Result<OpenFile> beneath(const std::filesystem::path& folder,
                                  const std::filesystem::path& inner, Way way = Way::at_once);
  OpenFile(OpenFile&& other) noexcept;
  OpenFile& operator=(OpenFile&&) = delete;
  ~OpenFile();

  /// The present state. Errors: io.
  [[nodiscard]] Result<Stamp> stamp() const;
  /// Fills `to` from byte `at` on. Errors: io, also if the file is too short.
  [[nodiscard]] Status read(std::uint64_t at, std::span<std::uint8_t> to) const;

 private:
  explicit OpenFile(int descriptor) : descriptor_(descriptor) {}
  int descriptor_;
};

// Reading a large file may be stopped early.

/// True: stop. Called often, on the thread that reads; empty: never stop.
using StopRequested = std::function<bool()>;

inline Error stopped_early(std::string where) {
  return {.code = Errc::wrong_state,
          .where = std::move(where),
          .what = "reading stopped before the end"};
}

/// A whole file. Errors: not_found, io, range if it is larger than `max_bytes`: a huge file is
/// refused before it is read.
Result<std::string> read_file(const std::filesystem::path& path, std::uintmax_t max_bytes);
/// The same for small texts such as recipes and rigs. Further error: parse, at a zero byte.
Result<std::string> read_text_file(const std::filesystem::path& path,
                                   std::uintmax_t max_bytes = 1 << 20);

}  // namespace weft::daemon
