#include "daemon/storage/recorder/sqlite.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <limits>
#include <utility>

#include "daemon/base/file/file_holders.hpp"
#include "daemon/storage/recorder/log_check.hpp"

namespace weft::daemon::sqlite {
namespace {

Errc code_of(int sqlite_code) {
  switch (sqlite_code & 0xFF) {
    case SQLITE_CORRUPT:
      return Errc::corrupt;
    case SQLITE_NOTADB:
      return Errc::parse;
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return Errc::busy;
    case SQLITE_FULL:
      return Errc::no_space;
    default:
      return Errc::io;
  }
}

/// Programs that have locked the file, for the error text; empty for another error or without a
/// known holder.
std::string holders_of(int sqlite_code, const FilePath& file) {
  if (!file || code_of(sqlite_code) != Errc::busy) return {};
  return file_holders({*file, *file + "-wal", *file + "-shm"});
}

std::string hint_for(Errc code) {
  if (code == Errc::no_space) return "Free some space on the disk";
  if (code == Errc::busy) return "Close the file in that program; nothing is damaged";
  if (code == Errc::io) return "Check the disk, its quota and the file size limit (ulimit -f)";
  return {};
}

tl::unexpected<Error> database_error(sqlite3* database, const FilePath& file, std::string what) {
  const int number = sqlite3_extended_errcode(database);
  const Errc code = code_of(number);
  const std::string holders = holders_of(number, file);
  return fail({.code = code,
               .where = file ? *file : "",
               .what = std::move(what),
               .got = std::string(sqlite3_errmsg(database)) +
                      (holders.empty() ? "" : " by " + holders) + " (SQLite " +
                      std::to_string(number) + ")",
               .hint = hint_for(code)});
}

/// SQLite deletes a log if its file is empty, even when only reading.
bool is_orphan(const std::filesystem::path& path) {
  std::error_code none;
  const std::uintmax_t bytes = std::filesystem::file_size(path, none);
  return (none || bytes == 0) && has_log(path);
}

bool is_there(const std::filesystem::path& path) {
  std::error_code none;
  return std::filesystem::exists(path, none);
}

/// True if the file header expects a log, but neither a log nor a rollback journal exists.
bool lacks_log(const std::filesystem::path& path) {
  constexpr std::size_t read_version_at = 19;
  constexpr std::uint8_t write_ahead = 2;
  if (is_there(log_of(path)) || is_there(path.string() + "-journal")) return false;
  std::array<std::uint8_t, read_version_at + 1> begin{};
  const auto file = RawFile::open(path);
  return file && file->fill(0, begin) && begin[read_version_at] == write_ahead;
}

/// URI that makes SQLite leave the folder unchanged: otherwise it would create an empty log beside
/// a file that lacks one.
std::string untouched_uri(const std::filesystem::path& path) {
  std::string uri = "file:";
  for (const char c : path.string()) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '/' || c == '.' || c == '-' || c == '_';
    std::array<char, 4> escaped{};
    std::snprintf(escaped.data(), escaped.size(), "%%%02X", static_cast<unsigned char>(c));
    uri += plain ? std::string(1, c) : std::string(escaped.data());
  }
  return uri + "?immutable=1";
}

/// True if a process died while it changed the journal mode of the file: the change must be rolled
/// back before any read, which is a write.
bool needs_rollback(sqlite3* database) {
  return sqlite3_exec(database, "PRAGMA schema_version", nullptr, nullptr, nullptr) != SQLITE_OK &&
         sqlite3_extended_errcode(database) == SQLITE_READONLY_ROLLBACK;
}

}  // namespace

Statement& Statement::bind(int index, std::int64_t value) {
  bind_result_ |= sqlite3_bind_int64(raw_.get(), index, value);
  return *this;
}

Statement& Statement::bind(int index, double value) {
  bind_result_ |= sqlite3_bind_double(raw_.get(), index, value);
  return *this;
}

Statement& Statement::bind(int index, std::string_view text) {
  bind_result_ |= sqlite3_bind_text64(raw_.get(), index, text.empty() ? "" : text.data(),
                                      text.size(), SQLITE_STATIC, SQLITE_UTF8);
  return *this;
}

Statement& Statement::bind(int index, ByteView blob) {
  bind_result_ |= sqlite3_bind_blob64(raw_.get(), index, blob.data(), blob.size(), SQLITE_STATIC);
  return *this;
}

Status Statement::run() {
  auto row = step();
  if (!row) return pass(std::move(row).error());
  sqlite3_reset(raw_.get());
  return {};
}

Result<bool> Statement::step() {
  sqlite3* database = sqlite3_db_handle(raw_.get());
  if (std::exchange(bind_result_, SQLITE_OK) != SQLITE_OK)
    return database_error(database, file_, "SQLite value not bound");
  const int code = sqlite3_step(raw_.get());
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) {
    sqlite3_reset(raw_.get());
    return false;
  }
  auto failure = database_error(database, file_, "SQLite statement failed");
  sqlite3_reset(raw_.get());
  return failure;
}

bool Statement::is_null(int column) const {
  return sqlite3_column_type(raw_.get(), column) == SQLITE_NULL;
}

std::int64_t Statement::integer(int column) const {
  return sqlite3_column_int64(raw_.get(), column);
}

double Statement::real(int column) const {
  return sqlite3_column_double(raw_.get(), column);
}

std::string Statement::text(int column) const {
  const auto* characters = sqlite3_column_text(raw_.get(), column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(raw_.get(), column));
  if (characters == nullptr) return {};
  return {reinterpret_cast<const char*>(characters), size};
}

ByteView Statement::blob(int column) const {
  const auto* bytes = static_cast<const std::uint8_t*>(sqlite3_column_blob(raw_.get(), column));
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(raw_.get(), column));
  return bytes == nullptr ? ByteView{} : ByteView(bytes, size);
}

Result<Database> Database::open_named(const std::filesystem::path& path, const std::string& name,
                                      int flags) {
  sqlite3* raw = nullptr;
  const int code = sqlite3_open_v2(name.c_str(), &raw, flags | SQLITE_OPEN_NOMUTEX, nullptr);
  Database database;
  database.raw_.reset(raw);
  database.file_ = std::make_shared<const std::string>(path.string());
  if (raw == nullptr)
    return fail(
        {.code = Errc::io, .where = path.string(), .what = "too little memory to open the file"});
  if (code != SQLITE_OK) return database_error(raw, database.file_, "file cannot be opened");
  return database;
}

Result<Database> Database::open_untouched(const std::filesystem::path& path) {
  return open_named(path, untouched_uri(path), SQLITE_OPEN_READONLY | SQLITE_OPEN_URI);
}

Result<Database> Database::open(const std::filesystem::path& path, Mode mode) {
  if (is_orphan(path))
    return fail({.code = Errc::corrupt,
                 .where = path.string(),
                 .what = "file missing or empty, but its log exists",
                 .hint = "Restore the file beside its log; nothing was changed"});
  if (mode == Mode::read_only && lacks_log(path)) return open_untouched(path);
  const int flags = mode == Mode::read_only    ? SQLITE_OPEN_READONLY
                    : mode == Mode::read_write ? SQLITE_OPEN_READWRITE
                                               : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  auto database = open_named(path, path.string(), flags);
  if (!database) return database;
  if (mode != Mode::read_only || !needs_rollback(database->raw_.get())) return database;
  auto writable = open(path, Mode::read_write);
  if (writable) static_cast<void>(writable->execute("PRAGMA schema_version; PRAGMA query_only=ON"));
  return writable;
}

void Database::wait_for_others(std::chrono::milliseconds longest, WaitCallback on_wait) {
  if (!wait_) wait_ = std::make_unique<Wait>();
  wait_->longest = longest;
  wait_->on_wait = std::move(on_wait);
  sqlite3_busy_handler(raw_.get(), &Wait::on_busy, wait_.get());
}

// SQLite passes the number of calls in this wait, from 0.
int Database::Wait::on_busy(void* self, int call) {
  constexpr std::chrono::milliseconds first{2}, most{50};
  auto& wait = *static_cast<Wait*>(self);
  if (call == 0) wait.waited = {};
  if (wait.waited >= wait.longest) return 0;
  const auto pause = std::min({first * (call + 1), most, wait.longest - wait.waited});
  sqlite3_sleep(static_cast<int>(pause.count()));
  const auto before = std::exchange(wait.waited, wait.waited + pause);
  if (wait.on_wait && before < report_after && wait.waited >= report_after)
    wait.on_wait(wait.waited);
  return 1;
}

sqlite3_file* Database::file() const {
  sqlite3_file* file = nullptr;
  const int code = sqlite3_file_control(raw_.get(), "main", SQLITE_FCNTL_FILE_POINTER, &file);
  return code == SQLITE_OK ? file : nullptr;
}

bool Database::has_moved() const {
  int moved = 0;  // stays 0 for a database in memory
  sqlite3_file_control(raw_.get(), "main", SQLITE_FCNTL_HAS_MOVED, &moved);
  return moved != 0;
}

Result<Statement> Database::prepare_to_write(std::string_view sql) {
  if (!has_moved()) return prepare(sql);
  return fail({.code = Errc::io,
               .where = file_ ? *file_ : "",
               .what = "file moved or removed while it was open"});
}

void Database::count_log_pages(int* pages) {
  sqlite3_wal_hook(
      raw_.get(),
      [](void* to, sqlite3*, const char*, int in_log) {
        *static_cast<int*>(to) = in_log;
        return SQLITE_OK;
      },
      pages);
}

Status Database::execute(const char* sql) {
  if (sqlite3_exec(raw_.get(), sql, nullptr, nullptr, nullptr) != SQLITE_OK)
    return database_error(raw_.get(), file_, "SQLite statement failed");
  return {};
}

Result<Statement> Database::prepare(std::string_view sql) {
  sqlite3_stmt* raw = nullptr;
  if (sqlite3_prepare_v3(raw_.get(), sql.data(), static_cast<int>(sql.size()),
                         SQLITE_PREPARE_PERSISTENT, &raw, nullptr) != SQLITE_OK)
    return database_error(raw_.get(), file_, "SQLite statement not prepared");
  return Statement(raw, file_);
}

Result<std::optional<std::int64_t>> Database::integer(std::string_view sql, std::string_view text) {
  auto query = prepare(sql);
  if (!query) return pass(std::move(query).error());
  if (!text.empty()) query->bind(1, text);
  const auto row = query->step();
  if (!row) return pass(row.error());
  return *row ? std::optional(query->integer(0)) : std::nullopt;
}

Result<RawFile> RawFile::open(const std::filesystem::path& path) {
  auto database = Database::open_untouched(path);
  if (!database) return pass(database.error());
  sqlite3_file* file = database->file();
  if (file == nullptr || file->pMethods == nullptr)
    return fail({.code = Errc::io, .where = path.string(), .what = "file not readable"});
  return RawFile(std::move(*database), file);
}

Result<std::size_t> RawFile::read(std::uint64_t at, std::span<std::uint8_t> to) const {
  sqlite3_int64 bytes = 0;
  if (file_->pMethods->xFileSize(file_, &bytes) != SQLITE_OK)
    return fail({.code = Errc::io, .what = "file size unknown"});
  const auto size = static_cast<std::uint64_t>(bytes);
  const std::size_t there =
      at >= size ? 0 : static_cast<std::size_t>(std::min<std::uint64_t>(to.size(), size - at));
  std::fill(to.begin() + static_cast<std::ptrdiff_t>(there), to.end(), std::uint8_t{0});
  if (there == 0) return there;
  if (there > static_cast<std::size_t>(std::numeric_limits<int>::max()) ||
      file_->pMethods->xRead(file_, to.data(), static_cast<int>(there),
                             static_cast<sqlite3_int64>(at)) != SQLITE_OK)
    return fail({.code = Errc::io, .what = "file not readable to its end"});
  return there;
}

bool RawFile::fill(std::uint64_t at, std::span<std::uint8_t> to) const {
  const auto got = read(at, to);
  return got && *got == to.size();
}

}  // namespace weft::daemon::sqlite
