#include "daemon/storage/recorder/log_check.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <fstream>

#include "daemon/storage/recorder/schema.hpp"
#include "daemon/storage/recorder/sqlite.hpp"
#include "protocols/base/bytes.hpp"

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t header_bytes = 32;
constexpr std::size_t frame_header_bytes = 24;
constexpr std::size_t summed_of_header = 24;
constexpr std::size_t summed_of_frame_header = 8;
constexpr std::uint32_t magic = 0x377F0682;  // lowest bit set: the checksums use big-endian words
constexpr std::uint32_t log_version = 3007000;

/// Unsigned, most significant byte first, like all numbers of the log.
std::uint32_t number_at(ByteView bytes, std::size_t at) {
  return std::uint32_t{bytes[at]} << 24 | std::uint32_t{bytes[at + 1]} << 16 |
         std::uint32_t{bytes[at + 2]} << 8 | std::uint32_t{bytes[at + 3]};
}

/// The log's two cumulative checksums.
struct Sums {
  std::uint32_t first = 0, second = 0;
  bool operator==(const Sums&) const = default;

  /// `bytes`: length is a multiple of eight.
  [[nodiscard]] Sums over(ByteView bytes, bool big_endian) const {
    Sums sums = *this;
    for (std::size_t at = 0; at + 8 <= bytes.size(); at += 8) {
      const auto word = [&](std::size_t i) {
        const std::uint32_t number = number_at(bytes, i);
        return big_endian ? number : __builtin_bswap32(number);
      };
      sums.first += word(at) + sums.second;
      sums.second += word(at + 4) + sums.first;
    }
    return sums;
  }
  static Sums at(ByteView bytes, std::size_t place) {
    return {number_at(bytes, place), number_at(bytes, place + 4)};
  }
};

struct LogHeader {
  bool big_endian = false;
  std::size_t page_bytes = 0;
  std::array<std::uint32_t, 2> salts{};
  Sums sums;
};

std::optional<LogHeader> header_from(ByteView bytes) {
  LogHeader header;
  header.big_endian = (number_at(bytes, 0) & 1) != 0;
  header.page_bytes = number_at(bytes, 8);
  header.salts = {number_at(bytes, 16), number_at(bytes, 20)};
  header.sums = Sums::at(bytes, 24);
  const bool possible = (number_at(bytes, 0) & ~1U) == magic &&
                        number_at(bytes, 4) == log_version &&
                        std::has_single_bit(header.page_bytes) && header.page_bytes >= 512 &&
                        header.page_bytes <= 65536;
  if (!possible || Sums{}.over(bytes.first(summed_of_header), header.big_endian) != header.sums)
    return std::nullopt;
  return header;
}

/// SQLite restarts a log at its first byte once all of it is in the file. A kill can leave the
/// first half of the new header over the old one. Its checkpoint count is then one too high for the
/// old checksums; this restores the old header.
std::optional<LogHeader> header_before_restart(Bytes bytes) {
  constexpr std::size_t last_of_count = 15;
  if (bytes[last_of_count]-- == 0) return std::nullopt;
  return header_from(bytes);
}

/// One frame: a page and its frame header.
class LogFrame {
 public:
  explicit LogFrame(const LogHeader& header)
      : header_(header), bytes_(frame_header_bytes + header.page_bytes) {}

  /// False at the end of the log, also within a frame.
  bool read(std::istream& in) {
    in.read(reinterpret_cast<char*>(bytes_.data()), static_cast<std::streamsize>(bytes_.size()));
    return in.good();
  }
  [[nodiscard]] std::size_t bytes() const { return bytes_.size(); }
  [[nodiscard]] std::uint64_t page() const { return number_at(bytes_, 0); }
  [[nodiscard]] ByteView content() const { return ByteView(bytes_).subspan(frame_header_bytes); }
  /// True if the frame belongs to this log and is not left from an earlier one.
  [[nodiscard]] bool is_own() const {
    return header_.salts == std::array{number_at(bytes_, 8), number_at(bytes_, 12)};
  }
  /// The last frame of a transaction stores the size of the file after it.
  [[nodiscard]] bool commits() const { return is_own() && number_at(bytes_, 4) != 0; }
  [[nodiscard]] Sums stored_sums() const { return Sums::at(bytes_, 16); }
  [[nodiscard]] Sums sums(const Sums& before) const {
    return before.over(ByteView(bytes_).first(summed_of_frame_header), header_.big_endian)
        .over(content(), header_.big_endian);
  }

 private:
  LogHeader header_;
  Bytes bytes_;
};

struct WalkedLog {
  LogState state;
  std::optional<LogFrame> last_commit;
};

// Frames after a damaged one can still be recognised by the checksums stored in the frame before
// them. For the frame directly after the damage, the checksums that the damaged frame should have
// stored also count. Only a committed transaction leaves such a commit frame. A killed process
// leaves frames without one, and they may lie behind frames that were appended later.
WalkedLog walk(std::istream& in, const LogHeader& header) {
  WalkedLog out;
  LogState& state = out.state;
  Sums before = header.sums;
  Sums mended;
  LogFrame frame(header);
  for (std::uint64_t at = header_bytes; frame.read(in); at += frame.bytes()) {
    const Sums sums = frame.sums(before);
    const bool sound = frame.is_own() && sums == frame.stored_sums();
    if (state.damage) {
      const bool next = at == state.damage->at + frame.bytes();
      if (frame.commits() && (sound || (next && frame.sums(mended) == frame.stored_sums())))
        ++state.damage->transactions_lost;
    } else if (!sound) {
      state.damage = {at, 0};
      mended = sums;
    } else if (frame.commits()) {
      ++state.transactions;
      out.last_commit = frame;
    }
    before = frame.stored_sums();
  }
  if (state.damage && state.damage->transactions_lost == 0) state.damage.reset();
  return out;
}

/// True if the file has the same content in this page as the log.
bool has_page_of(const fs::path& database, const LogFrame& frame) {
  const ByteView content = frame.content();
  Bytes page(content.size());
  const auto file = sqlite::RawFile::open(database);
  return file && file->fill((frame.page() - 1) * page.size(), page) &&
         std::equal(page.begin(), page.end(), content.begin());
}

std::string format_damage(const LogDamage& damage) {
  if (damage.at == 0) return "log damaged, no transaction readable";
  return "log damaged, " + std::to_string(damage.transactions_lost) +
         (damage.transactions_lost == 1 ? " transaction" : " transactions") +
         " from here on not readable";
}

std::string hint_of(const LogState& log) {
  if (log.transactions == 0) return "Restore the log from a copy; nothing was changed";
  return "Restore the log from a copy, or copy the folder and apply the readable part: "
         "sqlite3 campaign.sqlite 'PRAGMA wal_checkpoint(TRUNCATE)'";
}

}  // namespace

fs::path log_of(const fs::path& database) {
  return database.string() + "-wal";
}

bool has_log(const fs::path& database) {
  std::error_code none;
  const std::uintmax_t bytes = fs::file_size(log_of(database), none);
  return !none && bytes > 0;
}

Result<LogState> read_log(const fs::path& database) {
  const fs::path file = log_of(database);
  std::error_code none;
  LogState state;
  const std::uintmax_t bytes = fs::file_size(file, none);
  if (none || bytes == 0) return state;
  std::ifstream in(file, std::ios::binary);
  Bytes begin(header_bytes);
  state.bytes = bytes;
  if (bytes <= header_bytes) return state;  // killed before the first frame
  if (!in.read(reinterpret_cast<char*>(begin.data()), static_cast<std::streamsize>(begin.size())))
    return fail({.code = Errc::io, .where = file, .what = "write-ahead log not readable"});
  if (const auto header = header_from(begin)) {
    state = walk(in, *header).state;
  } else {
    const auto old = header_before_restart(begin);
    const std::optional<LogFrame> last = old ? walk(in, *old).last_commit : std::nullopt;
    if (!last || !has_page_of(database, *last)) state.damage = {0, 0};
  }
  state.bytes = bytes;
  return state;
}

Result<bool> expects_log(const fs::path& path) {
  auto database = sqlite::Database::open(path, sqlite::Mode::read_only);
  if (!database) return pass(database.error());
  const auto known = database->integer(has_table_sql, "log_expected");
  if (!known) return pass(known.error());
  if (!*known) return false;  // the file is older than the table
  const auto expected = database->integer("SELECT expected FROM log_expected");
  if (!expected) return pass(expected.error());
  return expected->value_or(0) != 0;
}

bool is_blank_campaign(const fs::path& path) {
  const auto log = read_log(path);
  if (!log || log->damage || log->transactions > 0) return false;
  std::error_code none;
  if (fs::file_size(path, none) == 0 && !none) return log->bytes == 0;
  auto database = sqlite::Database::open(path, sqlite::Mode::read_only);
  if (!database) return false;
  const auto tables = database->integer("SELECT count(*) FROM sqlite_schema");
  return tables && *tables == 0;
}

Status check_wal(const std::filesystem::path& campaign) {
  const std::string where = log_of(campaign).filename().string();
  const auto log = read_log(campaign);
  if (!log) return fail({.code = log.error().code, .where = where, .what = to_string(log.error())});
  if (log->damage)
    return fail({.code = Errc::corrupt,
                 .where = where + ": byte " + std::to_string(log->damage->at),
                 .what = format_damage(*log->damage),
                 .hint = hint_of(*log)});
  const auto expected = expects_log(campaign);  // other read errors are reported elsewhere
  if (!expected || !*expected || log->bytes > 0) return {};
  return fail({.code = Errc::corrupt,
               .where = where,
               .what = "log missing, with all data recorded since its last checkpoint",
               .hint = "Restore the log; an unfinished campaign needs both files"});
}

}  // namespace weft::daemon
