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

/// Whose errors these are, for people.
using FilePath = std::shared_ptr<const std::string>;

/// A prepared statement. Bound text and blobs must outlive the next run() or step().
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
  /// Nothing is NULL.
  template <class Value>
  Statement& bind(int index, const std::optional<Value>& value) {
    if (value) return bind(index, *value);
    bind_result_ |= sqlite3_bind_null(raw_.get(), index);
    return *this;
  }
  /// All parameters, from the first on.
  template <class... Values>
  Statement& bind_all(const Values&... values) {
    int index = 0;
    (bind(++index, values), ...);
    return *this;
  }

  /// For statements that return no row: executes and makes ready for the next bindings.
  Status run();
  /// bind_all() and run(): these values need not live longer.
  template <class First, class... Values>
  Status run(const First& first, const Values&... values) {
    return bind_all(first, values...).run();
  }
  /// True while there is a row to read. The statement is reset at the end and on failure.
  Result<bool> step();
  /// Gives the statement to `take`, which returns a Status or nothing, at each row that is left.
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
  /// A file that a kill left in the middle of a change is first put back as it was, also to be
  /// read. Errors: io, parse; wrong_state, where another process has it; corrupt, where there is a
  /// write-ahead log but no file for it.
  static Result<Database> open(const std::filesystem::path& path, Mode mode);
  /// Without its log, to be read: takes no lock and leaves the folder as it is. Errors: io.
  static Result<Database> open_untouched(const std::filesystem::path& path);

  /// Runs statements that return nothing of interest.
  Status execute(const char* sql);
  Result<Statement> prepare(std::string_view sql);
  /// Prepares `sql` and gives its rows to `take`, as Statement::each().
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
  /// The first column of the first row, with the only parameter `text` where there is one; nothing
  /// where there is no row.
  Result<std::optional<std::int64_t>> integer(std::string_view sql, std::string_view text = {});
  /// Writes into `pages`, after each commit, how many pages the write-ahead log has; from now on
  /// the caller folds it in.
  void count_log_pages(int* pages);
  /// Called on the waiting thread, once in a wait, after `report_after`: how long it has waited.
  using WaitCallback = std::function<void(std::chrono::milliseconds waited)>;
  static constexpr std::chrono::milliseconds report_after{1'000};
  /// From now on a statement waits so long for others to be done with the file.
  void wait_for_others(std::chrono::milliseconds longest, WaitCallback on_wait = {});
  /// The file beneath; of the database as long as it is open. Nothing: none.
  [[nodiscard]] sqlite3_file* file() const;
  /// The name that it was opened by is another file's by now, or nobody's: what is written is lost
  /// with the process.
  [[nodiscard]] bool has_moved() const;
  /// A statement that writes into a file that stays open for long. Errors: io, if it has moved.
  Result<Statement> prepare_to_write(std::string_view sql);
  /// As it was opened.
  [[nodiscard]] std::string name() const { return file_ ? *file_ : ""; }
  [[nodiscard]] std::int64_t last_row_id() const { return sqlite3_last_insert_rowid(raw_.get()); }

 private:
  struct Close {
    void operator()(sqlite3* raw) const { sqlite3_close_v2(raw); }
  };
  static Result<Database> open_named(const std::filesystem::path& path, const std::string& name,
                                     int flags);
  /// Of others that have the file locked; its place is SQLite's to keep.
  struct Wait {
    static int on_busy(void* self, int call);
    std::chrono::milliseconds longest{}, waited{};
    WaitCallback on_wait;
  };
  std::unique_ptr<Wait> wait_;  ///< outlives the connection
  std::unique_ptr<sqlite3, Close> raw_;
  FilePath file_;
};

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
