#pragma once
// The few SQLite calls that the recorder needs, with errors as values.

#include <sqlite3.h>

#include <chrono>
#include <concepts>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>

#include "protocols/base/bytes.hpp"
#include "protocols/base/result.hpp"

namespace weft::daemon::sqlite {

enum class Mode { read_only, read_write, create };

/// Path of the file, for error messages.
using FilePath = std::shared_ptr<const std::string>;

/// A prepared statement. Bound text and blobs must stay valid until the next run() or step() has
/// finished.
class Statement {
 public:
  Statement() = default;
  Statement(sqlite3_stmt* raw, FilePath file) : raw_(raw), file_(std::move(file)) {}

  Statement& bind(int index, std::int64_t value);
  Statement& bind(int index, double value);
  Statement& bind(int index, std::string_view text);
  Statement& bind(int index, ByteView blob);
  template <std::integral Int>
  Statement& bind(int index, Int value) {
    return bind(index, static_cast<std::int64_t>(value));
  }
  /// An empty optional is NULL.
  template <class Value>
  Statement& bind(int index, const std::optional<Value>& value) {
    if (value) return bind(index, *value);
    bind_result_ |= sqlite3_bind_null(raw_.get(), index);
    return *this;
  }
  /// Binds all parameters, starting with the first.
  template <class... Values>
  Statement& bind_all(const Values&... values) {
    int index = 0;
    (bind(++index, values), ...);
    return *this;
  }

  /// For statements that return no row: executes, then resets for the next bindings.
  Status run();
  /// bind_all() and run(); the values need not outlive the call.
  template <class First, class... Values>
  Status run(const First& first, const Values&... values) {
    return bind_all(first, values...).run();
  }
  /// True if a row is available. The statement is reset at the end and on failure.
  Result<bool> step();
  /// Calls `take` with the statement for each remaining row; `take` returns a Status or nothing.
  template <class Take>
  Status each(Take take) {
    auto row = step();
    for (; row && *row; row = step()) {
      if constexpr (std::is_void_v<std::invoke_result_t<Take, Statement&>>) {
        take(*this);
      } else {
        if (Status taken = take(*this); !taken) return taken;
      }
    }
    if (!row) return pass(std::move(row).error());
    return {};
  }

  [[nodiscard]] bool is_prepared() const { return raw_ != nullptr; }
  [[nodiscard]] bool is_null(int column) const;
  [[nodiscard]] std::int64_t integer(int column) const;
  [[nodiscard]] double real(int column) const;
  [[nodiscard]] std::string text(int column) const;
  [[nodiscard]] ByteView blob(int column) const;  ///< valid until the next step()

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* raw) const { sqlite3_finalize(raw); }
  };
  std::unique_ptr<sqlite3_stmt, Finalize> raw_;
  FilePath file_;
  int bind_result_ = SQLITE_OK;
};

/// An open database file, used by one thread at a time.
class Database {
 public:
  /// Opens a file. If a process was killed during a change, the change is rolled back first, even
  /// for reading. Errors: io, no_space, parse, busy if another process has locked the file; corrupt
  /// if a write-ahead log exists without its file.
  static Result<Database> open(const std::filesystem::path& path, Mode mode);
  /// Opens a file for reading without its log: does not lock it and leaves the folder unchanged.
  /// Errors: io.
  static Result<Database> open_untouched(const std::filesystem::path& path);

  /// Runs statements without results.
  Status execute(const char* sql);
  Result<Statement> prepare(std::string_view sql);
  /// Prepares `sql` and passes its rows to `take`, see Statement::each().
  template <class Take>
  Status each(std::string_view sql, Take take) {
    auto query = prepare(sql);
    if (!query) return pass(std::move(query).error());
    return query->each(std::move(take));
  }
  /// Prepares `sql` and runs it with `values`.
  template <class... Values>
  Status run(std::string_view sql, const Values&... values) {
    auto statement = prepare(sql);
    if (!statement) return pass(std::move(statement).error());
    return statement->run(values...);
  }
  /// The first column of the first row, with `text` as the only parameter, if any; nothing without
  /// a row.
  Result<std::optional<std::int64_t>> integer(std::string_view sql, std::string_view text = {});
  /// After each commit, stores the number of pages in the write-ahead log in `pages`. From now on
  /// the caller must fold the log.
  void count_log_pages(int* pages);
  /// Called on the waiting thread, once per wait, after `report_after`; `waited`: time waited so
  /// far.
  using WaitCallback = std::function<void(std::chrono::milliseconds waited)>;
  static constexpr std::chrono::milliseconds report_after{1'000};
  /// From now on a statement waits up to `longest` for other users of the file.
  void wait_for_others(std::chrono::milliseconds longest, WaitCallback on_wait = {});
  /// The underlying file, valid while the database is open; null if there is none.
  [[nodiscard]] sqlite3_file* file() const;
  /// True if the name of the open file belongs to another file or was removed: anything written is
  /// then lost when the process ends.
  [[nodiscard]] bool has_moved() const;
  /// For a statement that writes to a file that stays open for long. Errors: io if the file has
  /// moved.
  Result<Statement> prepare_to_write(std::string_view sql);
  /// The path, as it was opened.
  [[nodiscard]] std::string name() const { return file_ ? *file_ : ""; }
  [[nodiscard]] std::int64_t last_row_id() const { return sqlite3_last_insert_rowid(raw_.get()); }

 private:
  struct Close {
    void operator()(sqlite3* raw) const { sqlite3_close_v2(raw); }
  };
  static Result<Database> open_named(const std::filesystem::path& path, const std::string& name,
                                     int flags);
  /// State of a wait for other users of the file; SQLite keeps a pointer to it.
  struct Wait {
    static int on_busy(void* self, int call);
    std::chrono::milliseconds longest{}, waited{};
    WaitCallback on_wait;
  };
  std::unique_ptr<Wait> wait_;  ///< must outlive the connection
  std::unique_ptr<sqlite3, Close> raw_;
  FilePath file_;
};

/// Reads a file through SQLite's own descriptors. POSIX drops all locks of a process on a file when
/// it closes any descriptor of that file. Without its lock, a writer's log is deleted by the next
/// program that closes the file (SQLite, "How To Corrupt An SQLite Database File", 2.2). The file
/// need not be a database. Takes no lock, changes nothing.
class RawFile {
 public:
  /// Errors: io, also if there is no file.
  static Result<RawFile> open(const std::filesystem::path& path);

  /// Fills `to` from byte `at` on, with zeros after the end of the file. Returns the number of
  /// bytes the file has there. Errors: io.
  [[nodiscard]] Result<std::size_t> read(std::uint64_t at, std::span<std::uint8_t> to) const;
  /// True if the file has all of the bytes.
  [[nodiscard]] bool fill(std::uint64_t at, std::span<std::uint8_t> to) const;

 private:
  RawFile(Database database, sqlite3_file* file) : database_(std::move(database)), file_(file) {}
  Database database_;
  sqlite3_file* file_;  ///< owned by the database
};

}  // namespace weft::daemon::sqlite
