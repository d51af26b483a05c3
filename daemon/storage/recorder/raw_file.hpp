#pragma once
// The bytes of a file that this process may have open as a database.

#include <filesystem>

#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon::sqlite {

/// Reads through SQLite's own files: POSIX takes all of a process's locks on a file away when it
/// closes any descriptor of it, and without its lock a writer's log is deleted under it by the next
/// program that closes the file (SQLite, "How To Corrupt An SQLite Database File", 2.2). The file
/// need not be a database. Takes no lock, changes nothing.
class RawFile {
 public:
  /// Errors: io, also where there is no file.
  static Result<RawFile> open(const std::filesystem::path& path);

  /// Fills `to` from byte `at` on, zeros behind the end. Returns how many of the bytes the file
  /// has. Errors: io.
  [[nodiscard]] Result<std::size_t> read(std::uint64_t at, std::span<std::uint8_t> to) const;
  /// True where the file has all of them.
  [[nodiscard]] bool fill(std::uint64_t at, std::span<std::uint8_t> to) const;

 private:
  RawFile(Database database, sqlite3_file* file) : database_(std::move(database)), file_(file) {}
  Database database_;
  sqlite3_file* file_;  ///< the database's
};

}  // namespace weft::daemon::sqlite
