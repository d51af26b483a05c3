// Digests of the rows of a campaign file; declared in certificate.hpp.
#include <array>

#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/recorder/chunk.hpp"
#include "daemon/storage/recorder/schema.hpp"
#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon {
namespace {

/// Each value is preceded by its length; NULL differs from the empty text. Numbers are hashed as
/// SQLite prints them. With 17 digits, two texts are equal exactly if the numbers are.
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
  bool is_optional = false;  ///< present only with vibrations, or in a sweep
};

// Reals are printed with 17 digits, because SQLite's own text has 15.
constexpr std::array table_queries{
    TableQuery{"campaign", 17,
               "SELECT id, bench_kind, name, source, recipe_json, recipe_sha256, rig_json, "
               "rig_sha256, seed, software_version, taxels, printf('%!.17g', taxel_rate_hz), "
               "printf('%!.17g', wrench_rate_hz), printf('%!.17g', stage_rate_hz), trials_planned, "
               "created_utc_ns, finished FROM campaign ORDER BY id"},
    TableQuery{"axis", 3, "SELECT position, name, rotary FROM axis ORDER BY position"},
    TableQuery{"device", 3, "SELECT name, driver, identity_json FROM device ORDER BY rowid"},
    TableQuery{"journal", 4,
               "SELECT sequence, t_ns, kind, payload_json FROM journal ORDER BY sequence"},
    TableQuery{"block_stream", 6,
               "SELECT stream, printf('%!.17g', rate_hz), readings, axes, unit, "
               "printf('%!.17g', per_unit) FROM block_stream ORDER BY stream",
               true},
    TableQuery{"factor", 2, "SELECT position, name FROM factor ORDER BY position", true},
    TableQuery{"trial_factor", 3,
               "SELECT trial, position, printf('%!.17g', value) FROM trial_factor ORDER BY trial, "
               "position",
               true},
    TableQuery{"trial_place", 4,
               "SELECT trial, piece, mounting, patch FROM trial_place ORDER BY trial", true},
    TableQuery{"trial_rest", 4,
               "SELECT trial, printf('%!.17g', weight_n), printf('%!.17g', before_n), "
               "printf('%!.17g', after_n) FROM trial_rest ORDER BY trial",
               true}};

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
  Sha256 hash;
  const Status done = campaign.each(
      table.sql, [&](const sqlite::Statement& row) { add_row(hash, row, table.columns); });
  if (!done) return pass(done.error(), table.name);
  return to_hex(hash.finish());
}

Status add_chunk_rows(sqlite::Statement& chunks, Sha256& hash, CataloguedTrial& trial) {
  const Status done = chunks.bind_all(trial.id).each([&](const sqlite::Statement& row) {
    add_row(hash, row, chunk_columns);
    const std::int64_t stream = row.integer(0);
    const bool known = stream >= 0 && stream < std::int64_t{stream_count};
    if (row.integer(4) > 0)
      trial.gaps.push_back(
          {known ? std::string(to_string(static_cast<Stream>(stream))) : std::to_string(stream),
           static_cast<std::uint32_t>(row.integer(2)), static_cast<std::uint32_t>(row.integer(4))});
  });
  if (!done) return pass(done.error(), "chunk");
  return {};
}

}  // namespace

Result<std::vector<CertifiedTable>> table_digests(sqlite::Database& campaign) {
  std::vector<CertifiedTable> out;
  for (const TableQuery& table : table_queries) {
    if (table.is_optional) {
      const auto has_table = campaign.integer(has_table_sql, table.name);
      if (!has_table) return pass(has_table.error());
      if (!*has_table) continue;
    }
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
  Status chunks_read;
  const Status done = trials->each([&](const sqlite::Statement& row) -> Status {
    CataloguedTrial trial;
    trial.id = row.integer(0);
    Sha256 hash;
    add_row(hash, row, trial_columns);
    chunks_read = add_chunk_rows(*chunks, hash, trial);
    trial.sha256 = to_hex(hash.finish());
    out.push_back(std::move(trial));
    return chunks_read;
  });
  if (!done) return pass(done.error(), chunks_read ? "trial" : "");
  return out;
}

}  // namespace weft::daemon
