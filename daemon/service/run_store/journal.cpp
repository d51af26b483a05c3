// The journal in what the daemon remembers.

#include <algorithm>

#include "daemon/service/run_store/run_store.hpp"

namespace weft::daemon::runs {
namespace {

constexpr std::int64_t most_searched = 20'000;  // lines

JournalLine line_of(const sqlite::Statement& row) {
  return {row.integer(0), row.integer(1), row.text(2), row.text(3), row.text(4), row.text(5)};
}

}  // namespace

Status RunStore::write(const JournalLine& line) {
  auto insert = database_.prepare(
      "INSERT INTO journal (utc_us, run, kind, by, payload_json) VALUES (?,?,?,?,?)");
  if (!insert) return pass(insert.error());
  insert->bind(1, line.utc_us).bind(2, line.run).bind(3, line.kind).bind(4, line.by);
  insert->bind(5, line.payload_json);
  return insert->run();
}

Result<std::vector<JournalLine>> RunStore::tail(std::string_view run, std::size_t most) {
  auto query = database_.prepare(
      "SELECT sequence, utc_us, run, kind, by, payload_json FROM journal "
      "WHERE ?1 = '' OR run = ?1 ORDER BY sequence DESC LIMIT ?2");
  if (!query) return pass(query.error());
  query->bind(1, run).bind(2, static_cast<std::int64_t>(most));
  std::vector<JournalLine> lines;
  for (;;) {
    const auto row = query->step();
    if (!row) return pass(row.error());
    if (!*row) break;
    lines.push_back(line_of(*query));
  }
  std::reverse(lines.begin(), lines.end());
  return lines;
}

Result<RunStore::Page> RunStore::query(const Query& wanted) {
  auto newest = database_.prepare("SELECT coalesce(max(sequence), 0) FROM journal");
  if (!newest) return pass(newest.error());
  if (const auto row = newest->step(); !row) return pass(row.error());
  const std::int64_t last = newest->integer(0);
  const std::int64_t from = std::clamp<std::int64_t>(wanted.from, 1, last + 1);
  const std::int64_t end = std::min(last + 1, from + most_searched);
  auto query = database_.prepare(
      "SELECT sequence, utc_us, run, kind, by, payload_json FROM journal WHERE sequence >= ?1 AND "
      "sequence < ?2 AND (?3 = '' OR run = ?3) AND (?4 = '' OR kind = ?4) AND utc_us >= ?5 AND "
      "utc_us < ?6 ORDER BY sequence LIMIT ?7");
  if (!query) return pass(query.error());
  query->bind(1, from).bind(2, end).bind(3, wanted.run).bind(4, wanted.kind);
  query->bind(5, wanted.since_us).bind(6, wanted.until_us);
  query->bind(7, static_cast<std::int64_t>(wanted.most));
  Page page;
  for (;;) {
    const auto row = query->step();
    if (!row) return pass(row.error());
    if (!*row) break;
    page.lines.push_back(line_of(*query));
  }
  const bool full = page.lines.size() == wanted.most;
  const std::int64_t next = full ? page.lines.back().sequence + 1 : end;
  if (next <= last) page.next = next;
  return page;
}

}  // namespace weft::daemon::runs
