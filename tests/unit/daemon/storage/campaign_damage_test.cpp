#include <catch2/catch.hpp>

#include "daemon/storage/recorder/chunk.hpp"
#include "daemon/storage/recorder/sqlite.hpp"
#include "protocols/base/bytes.hpp"
#include "tests/unit/daemon/storage/support.hpp"

namespace campaign_damage_test {

using namespace weft;
using namespace weft::daemon;
using namespace weft::daemon::test;

namespace {

void alter(const std::filesystem::path& path, const char* sql) {
  auto database = sqlite::Database::open(path, sqlite::Mode::create);
  REQUIRE(database);
  REQUIRE(database->execute(sql));
}

Error load_error(const std::filesystem::path& path) {
  const auto dataset = load_campaign(path, {.all_outcomes = true});
  REQUIRE_FALSE(dataset);
  return dataset.error();
}

/// A number of rows with a size that wraps, in 64-bit numbers, to `bytes`, although `bytes` is no
/// multiple.
std::uint64_t rows_that_wrap(std::uint64_t bytes, std::uint64_t row) {
  std::uint64_t inverse = row;  // Newton's rule for odd numbers: the correct bits double each time
  for (int i = 0; i < 6; ++i) inverse *= 2 - row * inverse;
  return bytes * inverse;
}

}  // namespace

TEST_CASE("a chunk of more rows than there are numbers of bytes is refused at once") {
  const TemporaryFolder folder;
  const auto path = folder / "c.weft";
  REQUIRE(record_campaign(path, 1, 50));
  constexpr std::uint64_t row = row_bytes(Stream::wrench, 6);
  Bytes chunk;
  {
    auto database = sqlite::Database::open(path, sqlite::Mode::read_only);
    auto query = database->prepare("SELECT data FROM chunk WHERE stream = 1");
    REQUIRE(query->step().value());
    chunk.assign(query->blob(0).begin(), query->blob(0).end());
  }
  const std::size_t whole = chunk.size();
  std::uint64_t rows = std::uint64_t{1} << 63;
  for (std::size_t cut = 1; rows >> 63 != 0; ++cut) {
    REQUIRE(cut < row);
    chunk.resize(whole - cut);
    rows = rows_that_wrap(chunk.size(), row);
  }
  REQUIRE(rows * row == chunk.size());
  auto database = sqlite::Database::open(path, sqlite::Mode::read_write);
  auto change =
      database->prepare("UPDATE chunk SET data = ?, rows = ?, crc32 = ? WHERE stream = 1");
  change->bind(1, ByteView(chunk)).bind(2, static_cast<std::int64_t>(rows));
  change->bind(3, std::int64_t{crc32(chunk)});
  REQUIRE(change->run());
  CHECK(load_error(path).what == "chunk truncated");
}

TEST_CASE("a damaged chunk is named by trial, stream and number") {
  const TemporaryFolder folder;
  const auto path = folder / "c.weft";
  REQUIRE(record_campaign(path, 2, 50));
  SECTION("one flipped bit") {
    alter(
        path,
        "UPDATE chunk SET data = CAST(substr(data, 1, 100) || x'FF' || substr(data, 102) AS BLOB) "
        "WHERE trial = 2 AND stream = 1");
    const Error error = load_error(path);
    CHECK(error.code == Errc::corrupt);
    CHECK(error.where == path.string() + ": trial 0001-Silk-M1-r00: wrench chunk 0");
    CHECK(error.what.find("CRC-32") != std::string::npos);
  }
  SECTION("cut short") {
    alter(path, "UPDATE chunk SET data = substr(data, 1, length(data) - 1) WHERE stream = 0");
    CHECK(load_error(path).what == "chunk truncated");
  }
  SECTION("an absurd number of rows") {
    alter(path, "UPDATE chunk SET rows = 9223372036854775807");
    CHECK(load_error(path).code == Errc::corrupt);
    alter(path, "UPDATE chunk SET rows = -1");
    CHECK(load_error(path).code == Errc::corrupt);
  }
  SECTION("a chunk that is missing") {
    alter(path, "UPDATE chunk SET number = 1 WHERE stream = 2");
    CHECK(load_error(path).code == Errc::corrupt);
    CHECK(load_error(path).where.ends_with("chunk 1"));
  }
  SECTION("an unknown outcome or bench kind") {
    alter(path, "UPDATE trial SET outcome = 'splendid'");
    CHECK(load_error(path).got == "splendid");
    alter(path, "UPDATE campaign SET bench_kind = 'holodeck'");
    CHECK(load_error(path).got == "holodeck");
  }
  SECTION("no header row") {
    alter(path, "DELETE FROM campaign");
    CHECK(load_error(path).code == Errc::corrupt);
  }
}

TEST_CASE("files that are no campaign are told apart") {
  const TemporaryFolder folder;
  CHECK(load_error(folder / "absent").code == Errc::not_found);
  CHECK(load_error(folder.path()).code == Errc::not_found);
  write_file(folder / "text", std::string(5000, 'x'));
  CHECK(load_error(folder / "text").code == Errc::parse);
  write_file(folder / "empty", "");
  CHECK(load_error(folder / "empty").code == Errc::parse);
  alter(folder / "other", "CREATE TABLE t (x)");
  CHECK(load_error(folder / "other").code == Errc::parse);
  REQUIRE(record_campaign(folder / "later", 1, 5));
  alter(folder / "later", "PRAGMA user_version = 2");
  CHECK(load_error(folder / "later").code == Errc::unsupported);
}

TEST_CASE(
    "a campaign file cut at any page or flipped at many bytes is read or refused, never trusted") {
  const TemporaryFolder folder;
  const auto path = folder / "c.weft";
  REQUIRE(record_campaign(path, 3, 400));
  const std::string whole = read_file(path);
  const Dataset original = *load_campaign(path);
  for (std::size_t tenth = 0; tenth < 10; ++tenth) {
    write_file(folder / "cut", whole.substr(0, whole.size() * tenth / 10 + 17));
    const auto dataset = load_campaign(folder / "cut");
    CHECK_FALSE(dataset);
  }
  std::size_t unnoticed = 0;
  for (std::size_t at = 100; at < whole.size(); at += 997) {
    std::string flipped = whole;
    flipped[at] = static_cast<char>(flipped[at] ^ 0x10);
    write_file(folder / "flipped", flipped);
    const auto dataset = load_campaign(folder / "flipped");
    if (dataset && !same_content(*dataset, original)) ++unnoticed;
  }
  // Samples have CRCs; SQLite's own catalogue rows (names, times) have none, as
  // docs/reference/dataset.md states.
  CHECK(unnoticed <= 2);
}

}  // namespace campaign_damage_test
