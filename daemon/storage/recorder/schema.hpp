#pragma once
// The tables of a campaign file (docs/reference/dataset.md, "Campaign file").

namespace weft::daemon {

/// Identifies a Weft file in the SQLite header: "WEFT" in ASCII.
constexpr int campaign_application_id = 0x57454654;
constexpr int campaign_schema_version = 1;

constexpr const char* campaign_schema_sql = R"sql(
CREATE TABLE campaign (
  id INTEGER PRIMARY KEY CHECK (id = 1),
  bench_kind TEXT NOT NULL, name TEXT NOT NULL, source TEXT NOT NULL,
  recipe_json TEXT NOT NULL, recipe_sha256 TEXT NOT NULL,
  rig_json TEXT NOT NULL, rig_sha256 TEXT NOT NULL,
  seed TEXT NOT NULL, software_version TEXT NOT NULL,
  taxels INTEGER NOT NULL,
  taxel_rate_hz REAL NOT NULL, wrench_rate_hz REAL NOT NULL, stage_rate_hz REAL NOT NULL,
  trials_planned INTEGER NOT NULL, created_utc_ns INTEGER NOT NULL,
  finished INTEGER NOT NULL DEFAULT 0
) STRICT;
CREATE TABLE axis (
  position INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, rotary INTEGER NOT NULL
) STRICT;
CREATE TABLE device (
  name TEXT PRIMARY KEY, driver TEXT NOT NULL, identity_json TEXT NOT NULL
) STRICT;
CREATE TABLE trial (
  id INTEGER PRIMARY KEY,
  plan_index INTEGER NOT NULL, attempt INTEGER NOT NULL,
  label TEXT NOT NULL, trial_group TEXT NOT NULL, exploration TEXT NOT NULL,
  repetition INTEGER NOT NULL, patch_seed TEXT NOT NULL,
  began_ns INTEGER NOT NULL, ended_ns INTEGER, outcome TEXT,
  force_rms_error_n REAL, force_in_band_fraction REAL,
  UNIQUE (plan_index, attempt)
) STRICT;
CREATE TABLE chunk (
  trial INTEGER NOT NULL REFERENCES trial (id), stream INTEGER NOT NULL, number INTEGER NOT NULL,
  first_sequence INTEGER NOT NULL, rows INTEGER NOT NULL, lost_before INTEGER NOT NULL,
  t0_ns INTEGER NOT NULL, crc32 INTEGER NOT NULL, data BLOB NOT NULL,
  PRIMARY KEY (trial, stream, number)
) STRICT;
CREATE TABLE journal (
  sequence INTEGER PRIMARY KEY AUTOINCREMENT,
  t_ns INTEGER NOT NULL, kind TEXT NOT NULL, payload_json TEXT NOT NULL
) STRICT;
)sql";

/// 1 in the file itself while a log belongs to it, 0 in that log. So a file that has lost its log
/// can be recognised. One row; older files lack the table.
constexpr const char* log_expected_schema_sql = R"sql(
CREATE TABLE IF NOT EXISTS log_expected (
  id INTEGER PRIMARY KEY CHECK (id = 1), expected INTEGER NOT NULL
) STRICT;
)sql";

/// Created only for a sweep; other files stay identical to those of earlier versions. Values are
/// SI, as the factor names state.
constexpr const char* factor_schema_sql = R"sql(
CREATE TABLE factor (position INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE) STRICT;
CREATE TABLE trial_factor (
  trial INTEGER NOT NULL REFERENCES trial (id), position INTEGER NOT NULL REFERENCES factor (position),
  value REAL NOT NULL, PRIMARY KEY (trial, position)
) STRICT;
)sql";
constexpr const char* has_table_sql =
    "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ?";

/// Created with the first trial that has a known place.
constexpr const char* place_schema_sql = R"sql(
CREATE TABLE IF NOT EXISTS trial_place (
  trial INTEGER PRIMARY KEY REFERENCES trial (id),
  piece INTEGER NOT NULL, mounting INTEGER NOT NULL, patch INTEGER NOT NULL
) STRICT;
)sql";

/// Created with the first trial that has a measured rest.
constexpr const char* rest_schema_sql = R"sql(
CREATE TABLE IF NOT EXISTS trial_rest (
  trial INTEGER PRIMARY KEY REFERENCES trial (id), weight_n REAL NOT NULL,
  before_n REAL, after_n REAL
) STRICT;
)sql";

/// Created with the first block; files without vibrations stay identical to those of earlier
/// versions.
constexpr const char* block_stream_schema_sql = R"sql(
CREATE TABLE IF NOT EXISTS block_stream (
  stream INTEGER PRIMARY KEY, rate_hz REAL NOT NULL, readings INTEGER NOT NULL,
  axes INTEGER NOT NULL, unit TEXT NOT NULL, per_unit REAL NOT NULL
) STRICT;
)sql";

}  // namespace weft::daemon
