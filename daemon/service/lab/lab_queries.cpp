#include <algorithm>
#include <utility>

#include "daemon/service/lab/lab_store.hpp"

namespace weft::daemon::lab {
namespace {

constexpr std::size_t most_rows = 1000;

/// Conditions of a query: fixed SQL, with the values bound.
class Conditions {
 public:
  /// Adds a condition; each "?" of it is the value.
  void add(std::string_view sql, BoundText value) {
    values_.push_back(std::move(value));
    const std::string number = "$" + std::to_string(values_.size());
    text_ += text_.empty() ? " WHERE (" : " AND (";
    for (const char c : sql) c == '?' ? text_ += number : text_ += c;
    text_ += ')';
  }
  [[nodiscard]] const std::string& text() const { return text_; }
  [[nodiscard]] const std::vector<BoundText>& values() const { return values_; }

 private:
  std::string text_;
  std::vector<BoundText> values_;
};

constexpr const char* run_columns =
    "r.id, r.rig, r.run, r.recipe, r.recipe_sha256, r.seed, to_json(r.fabrics), r.bench, r.state,"
    " r.trials_planned, r.trials_complete,"
    " (extract(epoch FROM r.started_at) * 1000000)::bigint,"
    " (extract(epoch FROM r.ended_at) * 1000000)::bigint, r.place, r.revision";

RunEntry run_of(const Rows& rows, std::size_t row) {
  RunEntry run;
  run.key = rows.integer(row, 0);
  run.rig = rows.text(row, 1);
  run.run = rows.text(row, 2);
  run.recipe = rows.text(row, 3);
  run.recipe_sha256 = rows.text(row, 4);
  if (const auto seed = rows.optional_integer(row, 5)) run.seed = static_cast<std::uint64_t>(*seed);
  run.fabrics = rows.texts(row, 6);
  run.bench = bench_kind_from(rows.text(row, 7)).value_or(BenchKind::unknown);
  run.state = rows.text(row, 8);
  run.trials_planned = rows.integer(row, 9);
  run.trials_complete = rows.integer(row, 10);
  run.started_us = rows.integer(row, 11);
  run.ended_us = rows.optional_integer(row, 12);
  run.place = rows.text(row, 13);
  run.revision_us = rows.integer(row, 14);
  return run;
}

std::vector<RunEntry> runs_of(const Rows& rows) {
  std::vector<RunEntry> runs;
  for (std::size_t row = 0; row < rows.size(); ++row) runs.push_back(run_of(rows, row));
  return runs;
}

void add_filter(Conditions& conditions, const RunsFilter& filter) {
  constexpr const char* time =
      "timestamptz '1970-01-01 00:00:00+00' + ?::bigint * interval '1 microsecond'";
  if (!filter.rig.empty()) conditions.add("r.rig = ?", filter.rig);
  if (!filter.recipe.empty()) conditions.add("r.recipe = ?", filter.recipe);
  if (!filter.state.empty()) conditions.add("r.state = ?", filter.state);
  if (filter.bench != BenchKind::unknown)
    conditions.add("r.bench = ?", bound(to_string(filter.bench)));
  if (filter.since_us)
    conditions.add(std::string("r.started_at >= ") + time, bound(*filter.since_us));
  if (filter.until_us)
    conditions.add(std::string("r.started_at < ") + time, bound(*filter.until_us));
}

/// Pattern of LIKE for a part of the text.
std::string pattern_of(std::string_view word) {
  std::string pattern = "%";
  for (const char c : word) {
    if (c == '%' || c == '_' || c == '\\') pattern += '\\';
    pattern += c;
  }
  return pattern + "%";
}

void add_text(Conditions& conditions, std::string_view text) {
  constexpr std::string_view blanks = " \t\n";
  while (true) {
    const std::size_t begin = text.find_first_not_of(blanks);
    if (begin == std::string_view::npos) return;
    const std::size_t end = std::min(text.find_first_of(blanks, begin), text.size());
    conditions.add("r.search_text LIKE lower(?)", pattern_of(text.substr(begin, end - begin)));
    text.remove_prefix(end);
  }
}

/// Digits sort before 'g', so a range of texts has all digests with this beginning. One list of
/// ids, because an OR with the runs' own digest would read all runs.
constexpr const char* digest_condition =
    "r.id IN ("
    "SELECT id FROM weft.run WHERE recipe_sha256 >= ? AND recipe_sha256 < ? || 'g' UNION ALL "
    "SELECT run_id FROM weft.dataset WHERE dataset_sha256 >= ? AND dataset_sha256 < ? || 'g' "
    "UNION ALL SELECT run_id FROM weft.certificate"
    " WHERE certificate_sha256 >= ? AND certificate_sha256 < ? || 'g' UNION ALL "
    "SELECT run_id FROM weft.trial WHERE sha256 >= ? AND sha256 < ? || 'g')";

Result<std::string> read_digest(std::string_view typed) {
  std::string digest = lower_case(typed);
  const bool fits = digest.size() >= 4 && digest.size() <= 64 &&
                    digest.find_first_not_of("0123456789abcdef") == std::string::npos;
  if (fits) return digest;
  return fail({.code = Errc::invalid_argument,
               .where = "digest",
               .what = "no digest or beginning of one",
               .expected = "4 to 64 hexadecimal digits",
               .got = shortened(typed)});
}

Status check_limit(std::size_t limit) {
  if (limit >= 1 && limit <= most_rows) return {};
  return fail({.code = Errc::range,
               .where = "limit",
               .what = "number of rows out of range",
               .expected = "1 to " + std::to_string(most_rows),
               .got = std::to_string(limit)});
}

}  // namespace

Result<std::vector<RigEntry>> LabStore::rigs() {
  const auto rows =
      run("SELECT name, address, bench, state, rig_sha256, status::text, login,"
          " (extract(epoch FROM seen_at) * 1000000)::bigint FROM weft.rig ORDER BY name");
  if (!rows) return pass(rows.error());
  std::vector<RigEntry> out;
  for (std::size_t row = 0; row < rows->size(); ++row)
    out.push_back({.name = rows->text(row, 0),
                   .address = rows->text(row, 1),
                   .bench = bench_kind_from(rows->text(row, 2)).value_or(BenchKind::unknown),
                   .state = rows->text(row, 3),
                   .rig_sha256 = rows->text(row, 4),
                   .status_json = rows->text(row, 5),
                   .login = rows->text(row, 6),
                   .seen_us = rows->integer(row, 7)});
  return out;
}

Result<std::vector<DatasetEntry>> LabStore::datasets(std::string_view digest) {
  const auto wanted = read_digest(digest);
  if (!wanted) return pass(wanted.error());
  const auto rows =
      run("SELECT r.rig, r.run, d.dataset_sha256, d.trials, d.bytes, d.place FROM weft.dataset d"
          " JOIN weft.run r ON r.id = d.run_id WHERE d.dataset_sha256 >= $1"
          " AND d.dataset_sha256 < $1 || 'g' ORDER BY d.dataset_sha256, r.id LIMIT 1000",
          *wanted);
  if (!rows) return pass(rows.error());
  std::vector<DatasetEntry> out;
  for (std::size_t row = 0; row < rows->size(); ++row)
    out.push_back({rows->text(row, 0), rows->text(row, 1), rows->text(row, 2),
                   rows->integer(row, 3), rows->integer(row, 4), rows->text(row, 5)});
  return out;
}

Result<RunsPage> LabStore::runs(const RunsFilter& filter, std::optional<std::int64_t> after,
                                std::size_t limit) {
  if (const Status ok = check_limit(limit); !ok) return pass(ok.error());
  Conditions conditions;
  add_filter(conditions, filter);
  if (after)
    conditions.add(
        "(r.started_at, r.id) < (SELECT c.started_at, c.id FROM weft.run c WHERE c.id = ?)",
        bound(*after));
  const auto rows =
      run_bound("SELECT " + std::string(run_columns) + " FROM weft.run r" + conditions.text() +
                    " ORDER BY r.started_at DESC, r.id DESC LIMIT " + std::to_string(limit + 1),
                conditions.values());
  if (!rows) return pass(rows.error());
  RunsPage page;
  for (std::size_t row = 0; row < std::min(limit, rows->size()); ++row)
    page.runs.push_back(run_of(*rows, row));
  if (rows->size() > limit) page.next = page.runs.back().key;
  return page;
}

Result<std::vector<RunEntry>> LabStore::search(const LabSearch& search, std::size_t limit) {
  if (const Status ok = check_limit(limit); !ok) return pass(ok.error());
  Conditions conditions;
  add_filter(conditions, search);
  add_text(conditions, search.text);
  if (!search.fabric.empty())
    conditions.add("r.fabrics @> ?::text[]", bound(std::vector{search.fabric}));
  if (!search.digest.empty()) {
    auto digest = read_digest(search.digest);
    if (!digest) return pass(digest.error());
    conditions.add(digest_condition, std::move(*digest));
  }
  const std::string last = " ORDER BY r.started_at DESC, r.id DESC LIMIT " + std::to_string(limit);
  // A common word is found among the newest runs; a search of all would sort many.
  if (search.digest.empty()) {
    const auto newest = run_bound("SELECT " + std::string(run_columns) +
                                      " FROM (SELECT * FROM weft.run ORDER BY started_at DESC, id "
                                      "DESC LIMIT 2000) r" +
                                      conditions.text() + last,
                                  conditions.values());
    if (!newest) return pass(newest.error());
    if (newest->size() == limit) return runs_of(*newest);
  }
  // Without the barrier the planner may read all runs by start until `limit` of them fit.
  const auto rows = run_bound(
      "WITH found AS MATERIALIZED (SELECT r.id, r.started_at FROM weft.run r" + conditions.text() +
          "), newest AS (SELECT r.id FROM found r" + last + ") SELECT " + run_columns +
          " FROM newest JOIN weft.run r USING (id) ORDER BY r.started_at DESC, r.id DESC",
      conditions.values());
  if (!rows) return pass(rows.error());
  return runs_of(*rows);
}

}  // namespace weft::daemon::lab
