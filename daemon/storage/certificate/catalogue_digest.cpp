#include "daemon/storage/certificate/catalogue_digest.hpp"

#include <array>

#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/recorder/chunk.hpp"

namespace weft::daemon {
namespace {

/// Every value with its length in front, NULL apart from the empty text. Numbers as SQLite prints
/// them: 17 digits, so that two are the same text exactly when they are the same number.
void add_row(Sha256& hash, const sqlite::Statement& row, int columns) {
  for (int i = 0; i < columns; ++i) {
    const std::string text = row.text(i);
    hash.number(static_cast<std::uint8_t>(row.is_null(i) ? 0 : 1));
    hash.number(static_cast<std::uint64_t>(text.size())).text(text);
  }
}

struct TableQuery {
  const char* name;
  int columns;
  const char* sql;
};

// Reals as their 17 digits: SQLite's own text of them has 15.
constexpr std::array plain_tables{
    TableQuery{"campaign", 17,
               "SELECT id, bench_kind, name, source, recipe_json, recipe_sha256, rig_json, "
               "rig_sha256, seed, software_version, taxels, printf('%!.17g', taxel_rate_hz), "
               "printf('%!.17g', wrench_rate_hz), printf('%!.17g', stage_rate_hz), trials_planned, "
               "created_utc_ns, finished FROM campaign ORDER BY id"},
    TableQuery{"axis", 3, "SELECT position, name, rotary FROM axis ORDER BY position"},
    TableQuery{"device", 3, "SELECT name, driver, identity_json FROM device ORDER BY rowid"},
    TableQuery{"journal", 4,
               "SELECT sequence, t_ns, kind, payload_json FROM journal ORDER BY sequence"}};

/// In campaigns with vibrations; in those of a sweep.
constexpr std::array tables_of_some{
    TableQuery{"block_stream", 6,
               "SELECT stream, printf('%!.17g', rate_hz), readings, axes, unit, "
               "printf('%!.17g', per_unit) FROM block_stream ORDER BY stream"},
    TableQuery{"factor", 2, "SELECT position, name FROM factor ORDER BY position"},
    TableQuery{"trial_factor", 3,
               "SELECT trial, position, printf('%!.17g', value) FROM trial_factor ORDER BY trial, "
               "position"}};
constexpr const char* has_table_sql =
    "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ?";

constexpr int trial_columns = 13;
constexpr const char* trial_sql =
    "SELECT id, plan_index, attempt, label, trial_group, exploration, repetition, patch_seed, "
    "began_ns, ended_ns, outcome, printf('%!.17g', force_rms_error_n), "
    "printf('%!.17g', force_in_band_fraction) FROM trial ORDER BY plan_index, attempt";
constexpr int chunk_columns = 7;
constexpr const char* chunk_sql =
    "SELECT stream, number, first_sequence, rows, lost_before, t0_ns, crc32 FROM chunk "
    "WHERE trial = ? ORDER BY stream, number";

Result<std::string> digest_of_table(sqlite::Database& campaign, const TableQuery& table) {
  auto query = campaign.prepare(table.sql);
  if (!query) return pass(query.error(), table.name);
  Sha256 hash;
  while (true) {
    const auto row = query->step();
    if (!row) return pass(row.error(), table.name);
    if (!*row) return to_hex(hash.finish());
    add_row(hash, *query, table.columns);
  }
}

Status add_chunk_rows(sqlite::Statement& chunks, Sha256& hash, CataloguedTrial& trial) {
  chunks.bind(1, trial.id);
  while (true) {
    const auto row = chunks.step();
    if (!row) return pass(row.error(), "chunk");
    if (!*row) return {};
    add_row(hash, chunks, chunk_columns);
    const std::int64_t stream = chunks.integer(0);
    const bool known = stream >= 0 && stream < std::int64_t{stream_count};
    if (chunks.integer(4) > 0)
      trial.gaps.push_back(
          {known ? std::string(to_string(static_cast<Stream>(stream))) : std::to_string(stream),
           static_cast<std::uint32_t>(chunks.integer(2)),
           static_cast<std::uint32_t>(chunks.integer(4))});
  }
}

}  // namespace

Result<std::vector<CertifiedTable>> table_digests(sqlite::Database& campaign) {
  std::vector<CertifiedTable> out;
  for (const TableQuery& table : plain_tables) {
    auto digest = digest_of_table(campaign, table);
    if (!digest) return pass(digest.error());
    out.push_back({table.name, std::move(*digest)});
  }
  for (const TableQuery& table : tables_of_some) {
    auto has_table = campaign.prepare(has_table_sql);
    if (!has_table) return pass(has_table.error());
    has_table->bind(1, table.name);
    const auto row = has_table->step();
    if (!row) return pass(row.error());
    if (!*row) continue;
    auto digest = digest_of_table(campaign, table);
    if (!digest) return pass(digest.error());
    out.push_back({table.name, std::move(*digest)});
  }
  return out;
}

Result<std::vector<CataloguedTrial>> catalogued_trials(sqlite::Database& campaign) {
  auto trials = campaign.prepare(trial_sql);
  if (!trials) return pass(trials.error());
  auto chunks = campaign.prepare(chunk_sql);
  if (!chunks) return pass(chunks.error());
  std::vector<CataloguedTrial> out;
  while (true) {
    const auto row = trials->step();
    if (!row) return pass(row.error(), "trial");
    if (!*row) return out;
    CataloguedTrial trial;
    trial.id = trials->integer(0);
    Sha256 hash;
    add_row(hash, *trials, trial_columns);
    if (Status ok = add_chunk_rows(*chunks, hash, trial); !ok) return pass(ok.error());
    trial.sha256 = to_hex(hash.finish());
    out.push_back(std::move(trial));
  }
}

}  // namespace weft::daemon
