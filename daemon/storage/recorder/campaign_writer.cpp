#include "daemon/storage/recorder/campaign_writer.hpp"

#include <cmath>
#include <optional>

#include "daemon/base/file/file_holders.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/recorder/log_check.hpp"
#include "daemon/storage/recorder/schema.hpp"
#include "protocols/base/bytes.hpp"

namespace weft::daemon {
namespace {

/// Write-ahead log: readers are never blocked, and a killed process leaves complete transactions.
/// NORMAL: a crash of the operating system may lose the latest commits. A real-time bench cannot
/// repeat its trials, so it uses sync_commits().
constexpr const char* connection_sql =
    "PRAGMA page_size=16384; PRAGMA synchronous=NORMAL; PRAGMA foreign_keys=ON";
constexpr const char* log_sql = "PRAGMA journal_mode=WAL";

/// Time a statement waits for brief readers: the first opener of a file, also during its creation,
/// locks it for a moment. The bench does not move while the file is created or reopened; later only
/// the writer's thread waits.
constexpr std::chrono::milliseconds read_timeout{2'000};

/// Time the recording waits for another program that has locked the file. Meanwhile samples wait in
/// memory (WriterThread::most_waiting), or the clock of a simulated bench stops.
constexpr std::chrono::milliseconds lock_patience{30'000};

/// Time the end of a campaign waits for programs that have the file open, and for those that are
/// reading it.
constexpr std::chrono::milliseconds for_closing{500};
constexpr std::chrono::milliseconds for_reading{30'000};

/// The log is folded when it reaches 32 MiB.
constexpr int most_log_pages = 2000;

constexpr const char* log_expected_sql = "INSERT OR REPLACE INTO log_expected VALUES (1, 1)";
/// The first change in a new log.
constexpr const char* log_there_sql = "INSERT OR REPLACE INTO log_expected VALUES (1, 0)";
/// A killed process may not have written that change.
constexpr const char* log_there_again_sql = "UPDATE log_expected SET expected = 0 WHERE expected";

Status make_tables(sqlite::Database& database) {
  const std::string identity = "PRAGMA application_id=" + std::to_string(campaign_application_id) +
                               "; PRAGMA user_version=" + std::to_string(campaign_schema_version);
  if (Status done = database.execute(identity.c_str()); !done) return done;
  if (Status done = database.execute(campaign_schema_sql); !done) return done;
  return database.execute(log_expected_schema_sql);
}

Status write_header(sqlite::Database& database, const CampaignHeader& header) {
  const DatasetInfo& info = header.info;
  const auto digest = [](const std::string& given, const std::string& text) {
    return given.empty() && !text.empty() ? sha256_hex(text) : given;
  };
  return database.run(
      "INSERT INTO campaign (id, bench_kind, name, source, recipe_json, recipe_sha256, rig_json, "
      "rig_sha256, seed, software_version, taxels, taxel_rate_hz, wrench_rate_hz, stage_rate_hz, "
      "trials_planned, created_utc_ns) VALUES (1, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
      to_string(info.kind), info.name, info.source, info.recipe_json,
      digest(info.recipe_sha256, info.recipe_json), info.rig_json,
      digest(info.rig_sha256, info.rig_json),
      std::to_string(info.seed),  // as text: SQLite has no unsigned 64-bit integer
      info.software_version, header.taxels, info.taxel_rate_hz, info.wrench_rate_hz,
      info.stage_rate_hz, header.trials_planned, header.created_utc_ns);
}

Status write_axes(sqlite::Database& database, const std::vector<Axis>& axes) {
  for (std::size_t i = 0; i < axes.size(); ++i)
    if (auto done = database.run("INSERT INTO axis (position, name, rotary) VALUES (?, ?, ?)", i,
                                 axes[i].name, axes[i].rotary);
        !done)
      return done;
  return {};
}

Status write_factors(sqlite::Database& database, const std::vector<std::string>& factors) {
  if (factors.empty()) return {};
  Status done = database.execute(factor_schema_sql);
  for (std::size_t i = 0; done && i < factors.size(); ++i)
    done = database.run("INSERT INTO factor (position, name) VALUES (?, ?)", i, factors[i]);
  return done;
}

}  // namespace

Result<std::unique_ptr<CampaignWriter>> CampaignWriter::create(const std::filesystem::path& path,
                                                               const CampaignHeader& header) {
  auto database = sqlite::Database::open(path, sqlite::Mode::create);
  if (!database) return pass(std::move(database).error());
  database->wait_for_others(read_timeout);
  Status done = database->execute(connection_sql);
  if (done) done = database->execute(log_sql);
  // One transaction: after a kill the file has all of this or none of it.
  if (done) done = database->execute("BEGIN");
  if (done) done = make_tables(*database);
  if (done) done = write_header(*database, header);
  if (done) done = write_axes(*database, header.info.axes);
  if (done) done = write_factors(*database, header.info.factors);
  if (done && !header.simulation_json.empty())
    done = database->run("INSERT INTO journal (t_ns, kind, payload_json) VALUES (0, ?, ?)",
                         "simulation", header.simulation_json);
  if (done) done = database->execute("COMMIT");
  std::unique_ptr<CampaignWriter> writer(new CampaignWriter(std::move(*database)));
  if (done) done = writer->fold_log();
  if (done) done = writer->prepare();
  if (!done) return pass(std::move(done).error());
  writer->can_write_ = true;
  return writer;
}

Result<std::unique_ptr<CampaignWriter>> CampaignWriter::reopen(const std::filesystem::path& path) {
  // Checked before SQLite creates its own log. The file's header is not sufficient: a reader that
  // is open at the end of a campaign leaves a certified file that still expects a log.
  const bool killed = has_log(path);
  auto database = sqlite::Database::open(path, sqlite::Mode::read_write);
  if (!database) return pass(std::move(database).error());
  database->wait_for_others(read_timeout);
  Status done = database->execute(connection_sql);
  std::unique_ptr<CampaignWriter> writer(new CampaignWriter(std::move(*database)));
  if (done) done = writer->prepare();
  if (done && killed) done = writer->begin_writing();
  if (!done) return pass(std::move(done).error());
  return writer;
}

// Waits for brief readers. Takes the lock that begin_writing() needs, and releases it.
Status CampaignWriter::require_no_reader() {
  if (can_write_) return {};
  Status done = database_.execute("BEGIN EXCLUSIVE");
  return done ? database_.execute("ROLLBACK") : done;
}

Status CampaignWriter::begin_writing() {
  if (can_write_) return {};
  can_write_ = true;
  Status done = database_.execute(log_sql);
  if (done) done = database_.execute(log_expected_schema_sql);
  if (done) done = database_.execute(log_there_again_sql);
  return done ? fold_log() : guard(done);
}

Status CampaignWriter::prepare() {
  database_.count_log_pages(&log_pages_);
  const std::pair<sqlite::Statement*, const char*> statements[] = {
      {&insert_trial_,
       "INSERT INTO trial (plan_index, attempt, label, trial_group, exploration, "
       "repetition, patch_seed, began_ns) VALUES (?, ?, ?, ?, ?, ?, ?, ?)"},
      {&update_trial_,
       "UPDATE trial SET outcome = ?2, ended_ns = ?3, force_rms_error_n = ?4, "
       "force_in_band_fraction = ?5 WHERE id = ?1"},
      {&insert_chunk_,
       "INSERT INTO chunk (trial, stream, number, first_sequence, rows, lost_before, t0_ns, crc32, "
       "data) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)"},
      {&insert_journal_, "INSERT INTO journal (t_ns, kind, payload_json) VALUES (?, ?, ?)"},
      {&insert_device_, "INSERT INTO device (name, driver, identity_json) VALUES (?, ?, ?)"}};
  for (const auto& [statement, sql] : statements) {
    auto prepared = database_.prepare(sql);
    if (!prepared) return pass(std::move(prepared).error());
    *statement = std::move(*prepared);
  }
  return {};
}

Status CampaignWriter::guard(Status status) {
  if (!status && !failure_) failure_ = status.error();
  return status;
}

Status CampaignWriter::begin() {
  if (failure_) return tl::unexpected<Error>(*failure_);
  if (in_transaction_) return {};
  if (Status done = begin_writing(); !done) return done;
  if (Status done = guard(database_.execute("BEGIN")); !done) return done;
  in_transaction_ = true;
  return {};
}

void CampaignWriter::wait_for_locks(std::function<void(std::string)> on_wait) {
  const auto report = [file = database_.name(),
                       on_wait = std::move(on_wait)](std::chrono::milliseconds waited) {
    const std::string holders = file_holders({file, file + "-wal", file + "-shm"});
    on_wait(file + " has been locked for " + std::to_string(waited.count() / 1000) + " s by " +
            (holders.empty() ? "another program" : holders) + "; the run ends after " +
            std::to_string(lock_patience.count() / 1000) +
            " s of waiting. Close the file in that program");
  };
  database_.wait_for_others(lock_patience, report);
}

void CampaignWriter::sync_commits() {
  if (!commit()) return;  // the next call returns this error, as after every failed call
  static_cast<void>(guard(database_.execute("PRAGMA synchronous=FULL")));
}

Status CampaignWriter::device(const DeviceInfo& device) {
  if (Status open = begin(); !open) return open;
  return guard(insert_device_.run(device.name, device.driver, device.identity_json));
}

Status CampaignWriter::left_behind(TimePoint now, std::string_view kind,
                                   std::string_view payload_json) {
  if (Status open = begin(); !open) return open;
  Status done =
      guard(database_.execute("UPDATE trial SET outcome = 'interrupted' WHERE outcome IS NULL"));
  return done ? journal(now, kind, payload_json) : done;
}

Status CampaignWriter::resumed(TimePoint now, std::string_view payload_json) {
  if (Status open = begin(); !open) return open;
  Status done =
      guard(database_.execute("UPDATE trial SET outcome = 'interrupted' WHERE outcome IS NULL;"
                              "UPDATE campaign SET finished = 0"));
  return done ? journal(now, "resumed", payload_json) : done;
}

Status CampaignWriter::begin_trial(const TrialSpec& spec, TimePoint now) {
  if (Status open = begin(); !open) return open;
  Status done =
      guard(insert_trial_.run(spec.index, spec.attempt, spec.label, spec.group, spec.exploration,
                              spec.repetition, std::to_string(spec.patch_seed), ns_of(now)));
  trial_ = database_.last_row_id();
  for (std::size_t i = 0; done && i < spec.factors.size(); ++i)
    done = guard(database_.run("INSERT INTO trial_factor (trial, position, value) VALUES (?, ?, ?)",
                               trial_, i, spec.factors[i]));
  if (done && spec.place != TrialPlace{}) done = place(spec.place);
  return done ? commit() : done;
}

Status CampaignWriter::block_stream(const BlockStreamRecord& stream) {
  if (Status open = begin(); !open) return open;
  if (Status made = guard(database_.execute(block_stream_schema_sql)); !made) return made;
  return guard(database_.run(
      "INSERT OR IGNORE INTO block_stream (stream, rate_hz, readings, axes, unit, per_unit) VALUES "
      "(?, ?, ?, ?, ?, ?)",
      stream.stream, stream.format.rate_hz, stream.format.readings, stream.axes, stream.unit,
      stream.per_unit));
}

Status CampaignWriter::chunk(const ChunkRecord& chunk) {
  if (Status open = begin(); !open) return open;
  return guard(insert_chunk_.run(trial_, chunk.stream, chunk.number, chunk.first_sequence,
                                 chunk.rows, chunk.lost_before, chunk.t0_ns, crc32(chunk.bytes),
                                 chunk.bytes));
}

Status CampaignWriter::end_trial(TrialOutcome outcome, const TrialQuality& quality, TimePoint now) {
  if (Status open = begin(); !open) return open;
  Status done = guard(update_trial_.run(trial_, to_string(outcome), ns_of(now),
                                        quality.force_rms_error_n, quality.force_in_band_fraction));
  if (done && quality.rest) done = rest(*quality.rest);
  return done ? commit() : done;
}

Status CampaignWriter::place(const TrialPlace& place) {
  if (Status made = guard(database_.execute(place_schema_sql)); !made) return made;
  return guard(
      database_.run("INSERT INTO trial_place (trial, piece, mounting, patch) VALUES (?, ?, ?, ?)",
                    trial_, place.piece, place.mounting, place.patch));
}

Status CampaignWriter::rest(const RestForces& rest) {
  if (Status made = guard(database_.execute(rest_schema_sql)); !made) return made;
  const auto known = [](double force_n) {
    return std::isnan(force_n) ? std::nullopt : std::optional(force_n);
  };
  return guard(database_.run(
      "INSERT INTO trial_rest (trial, weight_n, before_n, after_n) VALUES (?, ?, ?, ?)", trial_,
      rest.weight_n, known(rest.before_n), known(rest.after_n)));
}

Status CampaignWriter::journal(TimePoint now, std::string_view kind,
                               std::string_view payload_json) {
  if (Status open = begin(); !open) return open;
  return guard(insert_journal_.run(ns_of(now), kind, payload_json));
}

Status CampaignWriter::commit() {
  if (failure_) return tl::unexpected<Error>(*failure_);
  if (!in_transaction_) return {};
  if (Status done = guard(database_.execute("COMMIT")); !done) return done;
  in_transaction_ = false;
  return log_pages_ < most_log_pages ? Status{} : fold_log();
}

// The log file keeps its length until its first page is rewritten. So a kill at any moment leaves a
// log beside a file that expects one.
Status CampaignWriter::fold_log() {
  Status done = guard(database_.execute(log_expected_sql));
  if (done) done = guard(database_.execute("PRAGMA wal_checkpoint(PASSIVE)"));
  if (done) done = guard(database_.execute(log_there_sql));
  return done;
}

Status CampaignWriter::finish() {
  Status done = begin();
  if (done) done = guard(database_.execute("UPDATE campaign SET finished = 1"));
  if (done) done = commit();
  if (done) done = guard(one_piece());
  return done;
}

// Without its log the campaign is one file that can be copied and read from a read-only place. If
// another process has the file open, the log cannot be removed; it is truncated instead.
Status CampaignWriter::one_piece() {
  database_.wait_for_others(for_closing);
  if (database_.execute("PRAGMA journal_mode=DELETE")) return {};
  database_.wait_for_others(for_reading);
  const auto busy = database_.integer("PRAGMA wal_checkpoint(TRUNCATE)");
  if (!busy) return pass(busy.error());
  if (*busy == 0) return {};
  return fail(
      {.code = Errc::wrong_state,
       .where = "the end of the campaign",
       .what = "campaign file constantly read by another program",
       .hint = "End that program, then resume the campaign to finish it; all trials are recorded"});
}

}  // namespace weft::daemon
