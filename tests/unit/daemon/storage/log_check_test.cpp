// The write-ahead log frame by frame, compared with SQLite's own reading.

#include "daemon/storage/recorder/log_check.hpp"

#include <catch2/catch.hpp>

#include "daemon/storage/recorder/campaign_history.hpp"
#include "daemon/storage/recorder/sqlite.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace log_check_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;

namespace {

constexpr std::size_t frame_bytes = 24 + 1024, header_bytes = 32;

sqlite::Database opened(const std::filesystem::path& file) {
  auto database = sqlite::Database::open(file, sqlite::Mode::create);
  REQUIRE(database);
  REQUIRE(
      database->execute("PRAGMA page_size=1024; PRAGMA journal_mode=WAL;"
                        "PRAGMA synchronous=NORMAL; PRAGMA wal_autocheckpoint=0"));
  return std::move(*database);
}

/// A copy as after a kill: `to` with its log, while `from` is open.
void copy_both(const std::filesystem::path& from, const std::filesystem::path& to) {
  write_file(to, read_file(from));
  write_file(log_of(to), read_file(log_of(from)));
  std::filesystem::remove(to.string() + "-shm");
}

std::int64_t rows_read(const std::filesystem::path& file) {
  auto database = sqlite::Database::open(file, sqlite::Mode::read_only);
  if (!database) return -1;
  auto query = database->prepare("SELECT count(*) FROM t");
  if (!query) return -1;
  const auto row = query->step();
  return row && *row ? query->integer(0) : -1;
}

/// One row a transaction, with enough pages for several frames.
void insert_rows(sqlite::Database& database, int count) {
  for (int i = 0; i < count; ++i)
    REQUIRE(database.execute("INSERT INTO t VALUES (randomblob(3000))"));
}

sqlite::Database with_rows(const std::filesystem::path& file, int count) {
  auto database = opened(file);
  REQUIRE(database.execute("CREATE TABLE t (data BLOB)"));
  insert_rows(database, count);
  return database;
}

LogState state_of(const std::filesystem::path& file) {
  const auto state = read_log(file);
  REQUIRE(state);
  return *state;
}

bool commits(const std::string& log, std::size_t at) {
  return log.substr(at + 4, 4) != std::string(4, '\0');
}

}  // namespace

TEST_CASE("a log that nothing happened to holds as many transactions as SQLite reads") {
  const TemporaryFolder folder;
  CHECK(state_of(folder / "none").bytes == 0);
  auto database = with_rows(folder / "a", 7);
  const LogState state = state_of(folder / "a");
  CHECK(state.transactions == 8);
  CHECK_FALSE(state.damage);
  CHECK(state.bytes == std::filesystem::file_size(folder / "a-wal"));
  // Restarted from its first byte: the rest belongs to the earlier log.
  REQUIRE(database.execute("PRAGMA wal_checkpoint(PASSIVE)"));
  insert_rows(database, 2);
  CHECK(state_of(folder / "a").transactions == 2);
  CHECK_FALSE(state_of(folder / "a").damage);
}

TEST_CASE("every flipped bit of a log is found, unless it costs the last transaction alone") {
  const TemporaryFolder folder;
  auto database = with_rows(folder / "a", 5);
  copy_both(folder / "a", folder / "b");
  const std::string whole = read_file(folder / "b-wal");
  REQUIRE((whole.size() - header_bytes) % frame_bytes == 0);
  std::size_t last = whole.size() - 2 * frame_bytes;
  while (!commits(whole, last)) last -= frame_bytes;
  last += frame_bytes;  // start of the last transaction
  REQUIRE(rows_read(folder / "b") == 5);
  for (std::size_t at = 0; at < whole.size(); at += at % frame_bytes < header_bytes + 24 ? 1 : 37) {
    std::string bent = whole;
    bent[at] = static_cast<char>(bent[at] ^ 1 << at % 8);
    write_file(folder / "b-wal", bent);
    std::filesystem::remove(folder / "b-shm");
    const LogState state = state_of(folder / "b");
    const std::int64_t rows = rows_read(folder / "b");
    INFO("byte " << at << " of " << whole.size());
    if (at >= last) {
      CHECK(rows >= 4);
      continue;
    }
    CHECK(rows < 5);
    REQUIRE(state.damage);
    CHECK(state.damage->at == (at < header_bytes ? 0 : at - (at - header_bytes) % frame_bytes));
    CHECK(static_cast<std::int64_t>(state.transactions) == std::max<std::int64_t>(rows + 1, 0));
  }
}

TEST_CASE("a log that ends within a frame or a transaction is no damage") {
  const TemporaryFolder folder;
  auto database = with_rows(folder / "a", 4);
  copy_both(folder / "a", folder / "b");
  const std::string whole = read_file(folder / "b-wal");
  for (std::size_t size = 0; size <= whole.size(); size += 211) {
    write_file(folder / "b-wal", whole.substr(0, size));
    INFO(size << " bytes");
    CHECK_FALSE(state_of(folder / "b").damage);
  }
}

TEST_CASE("what a killed process had begun, behind what the next one wrote, is no damage") {
  const TemporaryFolder folder;
  auto first = with_rows(folder / "a", 2);
  REQUIRE(first.execute("PRAGMA cache_size=4; BEGIN"));
  insert_rows(first, 12);  // more than the cache holds: a part is in the log already
  copy_both(folder / "a", folder / "b");
  const auto begun = std::filesystem::file_size(folder / "b-wal");
  auto second = opened(folder / "b");
  insert_rows(second, 1);
  copy_both(folder / "b", folder / "c");
  REQUIRE(std::filesystem::file_size(folder / "c-wal") == begun);
  CHECK(state_of(folder / "c").transactions == 4);
  CHECK_FALSE(state_of(folder / "c").damage);
  CHECK(rows_read(folder / "c") == 3);
}

TEST_CASE("a log that is begun anew may be torn in its header, and only then holds without one") {
  const TemporaryFolder folder;
  auto database = with_rows(folder / "a", 3);
  copy_both(folder / "a", folder / "unfolded");
  const std::string before = read_file(folder / "a-wal");
  REQUIRE(database.execute("PRAGMA wal_checkpoint(PASSIVE)"));
  copy_both(folder / "a", folder / "b");
  insert_rows(database, 1);
  const std::string torn = read_file(folder / "a-wal").substr(0, 16) + before.substr(16);
  write_file(folder / "b-wal", torn);
  CHECK_FALSE(state_of(folder / "b").damage);
  CHECK(rows_read(folder / "b") == 3);
  write_file(folder / "unfolded-wal", torn);
  CHECK(state_of(folder / "unfolded").damage);
}

TEST_CASE("a log with a missing or empty file is not opened and stays unchanged") {
  const TemporaryFolder folder;
  {
    auto database = with_rows(folder / "a", 1);
    copy_both(folder / "a", folder / "b");
  }
  const std::string log = read_file(folder / "b-wal");
  write_file(folder / "b", "");
  const auto refused = [&](sqlite::Mode mode) {
    const auto database = sqlite::Database::open(folder / "b", mode);
    REQUIRE_FALSE(database);
    CHECK(database.error().code == Errc::corrupt);
    CHECK(read_file(folder / "b-wal") == log);
  };
  refused(sqlite::Mode::read_only);
  std::filesystem::remove(folder / "b");
  refused(sqlite::Mode::create);
}

TEST_CASE("reading a file that lacks its log leaves the folder as it is") {
  const TemporaryFolder folder;
  const auto odd = folder / "a %?#b";
  {
    auto database = with_rows(folder / "a", 3);
    REQUIRE(database.execute("PRAGMA wal_checkpoint(TRUNCATE)"));
    write_file(odd, read_file(folder / "a"));
  }
  CHECK(rows_read(odd) == 3);
  CHECK_FALSE(std::filesystem::exists(log_of(odd)));
}

TEST_CASE("a campaign file records that its log is missing, also after a checkpoint of the log") {
  const TemporaryFolder folder;
  const auto rows_without_log = [&](int rows) {
    const auto file = folder / (std::to_string(rows) + ".sqlite");
    auto recorder = Recorder::create(file, small_header());
    REQUIRE(recorder);
    const std::string long_line(1 << 20, 'x');
    for (int i = 0; i < rows; ++i) {
      REQUIRE(recorder->journal(at_ms(i), "line", long_line));
      REQUIRE(recorder->commit());
    }
    CHECK(state_of(file).bytes < 36U << 20);
    const auto lone = folder / (std::to_string(rows) + "-lone.sqlite");
    write_file(lone, read_file(file));
    CHECK(expects_log(lone).value());
    CHECK_FALSE(expects_log(file).value());
    CHECK(load_journal(file).value().size() == static_cast<std::size_t>(rows));
    return load_journal(lone).value().size();
  };
  CHECK(rows_without_log(1) == 0);
  CHECK(rows_without_log(40) >= 30);
}

}  // namespace log_check_test
