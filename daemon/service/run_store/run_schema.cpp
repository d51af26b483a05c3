#include "daemon/service/run_store/run_schema.hpp"

#include <array>
#include <string>
#include <string_view>

namespace weft::daemon::runs {
namespace {

constexpr const char* schema_sql = R"sql(
CREATE TABLE IF NOT EXISTS run (
  number INTEGER PRIMARY KEY AUTOINCREMENT,
  recipe TEXT NOT NULL, rig TEXT NOT NULL, folder TEXT NOT NULL, seed TEXT NOT NULL,
  name TEXT NOT NULL, by TEXT NOT NULL, created_us INTEGER NOT NULL,
  state TEXT NOT NULL, outcome TEXT NOT NULL, cleanup TEXT NOT NULL, rig_fact TEXT NOT NULL,
  error TEXT NOT NULL, dataset_sha256 TEXT NOT NULL, resume INTEGER NOT NULL DEFAULT 0,
  recovered TEXT NOT NULL DEFAULT '', bench TEXT NOT NULL DEFAULT '',
  trials_done INTEGER, trials_planned INTEGER, recipe_sha256 TEXT NOT NULL DEFAULT '',
  dataset_error TEXT NOT NULL DEFAULT '', rig_untaken INTEGER NOT NULL DEFAULT 0,
  bench_outcome TEXT NOT NULL DEFAULT '', bench_error TEXT NOT NULL DEFAULT '',
  disk_bytes INTEGER NOT NULL DEFAULT 0
) STRICT;
CREATE TABLE IF NOT EXISTS recipe (sha256 TEXT PRIMARY KEY, text TEXT NOT NULL) STRICT;
CREATE TABLE IF NOT EXISTS journal (
  sequence INTEGER PRIMARY KEY AUTOINCREMENT, utc_us INTEGER NOT NULL,
  run TEXT NOT NULL, kind TEXT NOT NULL, by TEXT NOT NULL, payload_json TEXT NOT NULL
) STRICT;
CREATE TABLE IF NOT EXISTS line (
  id INTEGER PRIMARY KEY CHECK (id = 1), revision INTEGER NOT NULL, held_by TEXT NOT NULL
) STRICT;
CREATE TABLE IF NOT EXISTS waiting (place INTEGER PRIMARY KEY, run INTEGER NOT NULL) STRICT;
CREATE TABLE IF NOT EXISTS rig (
  id INTEGER PRIMARY KEY CHECK (id = 1), fact TEXT NOT NULL, why TEXT NOT NULL
) STRICT;
CREATE TABLE IF NOT EXISTS answer (
  number INTEGER PRIMARY KEY AUTOINCREMENT, name TEXT NOT NULL UNIQUE, fingerprint TEXT NOT NULL,
  asked_us INTEGER NOT NULL, result TEXT, error TEXT, token TEXT NOT NULL DEFAULT ''
) STRICT;
CREATE TABLE IF NOT EXISTS hand_over (
  run INTEGER PRIMARY KEY, state TEXT NOT NULL, by TEXT NOT NULL, error TEXT NOT NULL,
  result_json TEXT NOT NULL, attempts INTEGER NOT NULL DEFAULT 0
) STRICT;
)sql";

/// A column that younger files have from the beginning.
struct LaterColumn {
  std::string_view table, name, type;
};
constexpr std::string_view text = "TEXT NOT NULL DEFAULT ''", count = "INTEGER NOT NULL DEFAULT 0";
constexpr std::array<LaterColumn, 13> later_columns{{{"run", "resume", count},
                                                     {"run", "recovered", text},
                                                     {"run", "bench", text},
                                                     {"run", "trials_done", "INTEGER"},
                                                     {"run", "trials_planned", "INTEGER"},
                                                     {"run", "recipe_sha256", text},
                                                     {"run", "dataset_error", text},
                                                     {"run", "rig_untaken", count},
                                                     {"run", "bench_outcome", text},
                                                     {"run", "bench_error", text},
                                                     {"run", "disk_bytes", count},
                                                     {"answer", "token", text},
                                                     {"hand_over", "attempts", count}}};

}  // namespace

Status make_tables(sqlite::Database& database) {
  if (Status made = database.execute(schema_sql); !made) return made;
  for (const auto& [table, name, type] : later_columns) {
    auto query = database.prepare("SELECT count(*) FROM pragma_table_info(?) WHERE name = ?");
    if (!query) return pass(query.error());
    query->bind(1, table).bind(2, name);
    const auto row = query->step();
    if (!row) return pass(row.error());
    if (query->integer(0) > 0) continue;
    std::string alter("ALTER TABLE ");
    alter.append(table).append(" ADD COLUMN ").append(name).append(" ").append(type);
    if (Status done = database.execute(alter.c_str()); !done) return done;
  }
  return {};
}

}  // namespace weft::daemon::runs
