#include "daemon/recorder/recorder.hpp"

#include "daemon/dataset/sha256.hpp"
#include "daemon/recorder/chunk.hpp"
#include "daemon/recorder/schema.hpp"
#include "daemon/recorder/sqlite.hpp"
#include "protocols/base/crc.hpp"

namespace weft::daemon {
namespace {

/// Rows per stream before a chunk is closed: 82 s at 100 Hz, a whole trial in most recipes.
constexpr std::size_t chunk_rows = 8192;

constexpr const char* insert_chunk_sql =
    "INSERT INTO chunk (trial, stream, number, first_sequence, rows, lost_before, t0_ns, crc32, "
    "data) "
    "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)";

std::int64_t ns_of(TimePoint t) {
  return t.time_since_epoch().count();
}

/// Write-ahead log: readers are never blocked and a killed process leaves whole transactions.
/// NORMAL: an operating system that goes down may take the latest commits with it, never the file.
Status configure(sqlite::Database& database) {
  const std::string identity = "PRAGMA application_id=" + std::to_string(campaign_application_id) +
                               "; PRAGMA user_version=" + std::to_string(campaign_schema_version);
  for (const std::string& sql :
       {std::string("PRAGMA page_size=16384; PRAGMA journal_mode=WAL; PRAGMA synchronous=NORMAL;"
                    "PRAGMA foreign_keys=ON; PRAGMA wal_autocheckpoint=2000"),
        identity, std::string(campaign_schema_sql)})
    if (auto done = database.execute(sql.c_str()); !done) return done;
  return {};
}

Status write_header(sqlite::Database& database, const CampaignHeader& header) {
  auto insert = database.prepare(
      "INSERT INTO campaign (id, bench_kind, name, source, recipe_json, recipe_sha256, rig_json, "
      "rig_sha256, seed, software_version, taxels, taxel_rate_hz, wrench_rate_hz, stage_rate_hz, "
      "trials_planned, created_utc_ns) VALUES (1, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)");
  if (!insert) return pass(std::move(insert).error());
  const DatasetInfo& info = header.info;
  const auto digest = [](const std::string& given, const std::string& text) {
    return given.empty() && !text.empty() ? sha256_hex(text) : given;
  };
  const std::string recipe_sha256 = digest(info.recipe_sha256, info.recipe_json);
  const std::string rig_sha256 = digest(info.rig_sha256, info.rig_json);
  const std::string seed = std::to_string(info.seed);  // as text: SQLite has no unsigned 64 bit
  insert->bind(1, to_string(info.kind)).bind(2, info.name).bind(3, info.source);
  insert->bind(4, info.recipe_json).bind(5, recipe_sha256);
  insert->bind(6, info.rig_json).bind(7, rig_sha256).bind(8, seed).bind(9, info.software_version);
  insert->bind(10, static_cast<std::int64_t>(header.taxels)).bind(11, info.taxel_rate_hz);
  insert->bind(12, info.wrench_rate_hz).bind(13, info.stage_rate_hz);
  insert->bind(14, std::int64_t{header.trials_planned}).bind(15, header.created_utc_ns);
  return insert->run();
}

Status write_axes(sqlite::Database& database, const std::vector<Axis>& axes) {
  auto insert = database.prepare("INSERT INTO axis (position, name, rotary) VALUES (?, ?, ?)");
  if (!insert) return pass(std::move(insert).error());
  for (std::size_t i = 0; i < axes.size(); ++i) {
    insert->bind(1, static_cast<std::int64_t>(i)).bind(2, axes[i].name);
    insert->bind(3, std::int64_t{axes[i].rotary ? 1 : 0});
    if (auto done = insert->run(); !done) return done;
  }
  return {};
}

}  // namespace

struct Recorder::Impl {
  Impl(sqlite::Database open_database, const CampaignHeader& header)
      : database(std::move(open_database)),
        axes(header.info.axes),
        buffers{ChunkBuffer(Stream::taxel, header.taxels, chunk_rows),
                ChunkBuffer(Stream::wrench, 6, chunk_rows),
                ChunkBuffer(Stream::stages, header.info.axes.size(), chunk_rows)} {}

  sqlite::Database database;
  sqlite::Statement insert_trial, update_trial, insert_chunk, insert_journal, insert_device;
  std::vector<Axis> axes;
  std::array<ChunkBuffer, 3> buffers;  ///< by Stream
  std::array<std::int64_t, 3> next_chunk_number{};
  std::optional<std::int64_t> trial;  ///< row of the open trial
  bool in_transaction = false;
  bool finished = false;
  std::optional<Error> failure;  ///< the first; ends all recording
  std::optional<std::chrono::nanoseconds> last_commit;

  Status prepare();
  Status ready(bool trial_open);
  Status begin();
  Status write_chunk(ChunkBuffer& buffer);
  Status write_chunks();
  Status commit();
  /// Keeps the first failure of the file.
  Status guard(Status status);

  ChunkBuffer& buffer(Stream stream) { return buffers[static_cast<std::size_t>(stream)]; }
  /// The buffer, with room for a row of this stamp.
  Result<ChunkBuffer*> open_buffer(Stream stream, const Stamp& stamp);
};

Status Recorder::Impl::prepare() {
  const auto into = [this](sqlite::Statement& statement, const char* sql) -> Status {
    auto prepared = database.prepare(sql);
    if (!prepared) return pass(std::move(prepared).error());
    statement = std::move(*prepared);
    return {};
  };
  Status done = into(insert_trial,
                     "INSERT INTO trial (plan_index, attempt, label, trial_group, exploration, "
                     "repetition, patch_seed, began_ns) VALUES (?, ?, ?, ?, ?, ?, ?, ?)");
  if (done)
    done = into(update_trial,
                "UPDATE trial SET outcome = ?2, ended_ns = ?3, force_rms_error_n = ?4, "
                "force_in_band_fraction = ?5 WHERE id = ?1");
  if (done) done = into(insert_chunk, insert_chunk_sql);
  if (done)
    done = into(insert_journal, "INSERT INTO journal (t_ns, kind, payload_json) VALUES (?, ?, ?)");
  if (done)
    done = into(insert_device, "INSERT INTO device (name, driver, identity_json) VALUES (?, ?, ?)");
  return done;
}

Status Recorder::Impl::guard(Status status) {
  if (!status && !failure) failure = status.error();
  return status;
}

Status Recorder::Impl::ready(bool trial_open) {
  if (failure) return tl::unexpected<Error>(*failure);
  if (finished) return fail(Errc::wrong_state, "the campaign file has been finished");
  if (trial.has_value() != trial_open)
    return fail(Errc::wrong_state, trial_open ? "no trial is open to record into"
                                              : "the last trial has not been ended");
  return {};
}

Status Recorder::Impl::begin() {
  if (in_transaction) return {};
  if (auto done = database.execute("BEGIN"); !done) return done;
  in_transaction = true;
  return {};
}

Status Recorder::Impl::write_chunk(ChunkBuffer& chunk) {
  if (chunk.empty()) return {};
  if (auto done = begin(); !done) return done;
  const auto stream = static_cast<std::size_t>(chunk.stream());
  insert_chunk.bind(1, *trial).bind(2, static_cast<std::int64_t>(stream));
  insert_chunk.bind(3, next_chunk_number[stream]++).bind(4, std::int64_t{chunk.first_sequence()});
  insert_chunk.bind(5, std::int64_t{chunk.rows()}).bind(6, std::int64_t{chunk.lost_before()});
  insert_chunk.bind(7, chunk.t0_ns()).bind(8, std::int64_t{crc32(chunk.bytes())});
  insert_chunk.bind(9, chunk.bytes());
  if (auto done = insert_chunk.run(); !done) return done;
  chunk.clear();
  return {};
}

Status Recorder::Impl::write_chunks() {
  for (ChunkBuffer& chunk : buffers)
    if (auto done = write_chunk(chunk); !done) return done;
  return {};
}

Status Recorder::Impl::commit() {
  if (!in_transaction) return {};
  if (auto done = database.execute("COMMIT"); !done) return done;
  in_transaction = false;
  return {};
}

Result<ChunkBuffer*> Recorder::Impl::open_buffer(Stream stream, const Stamp& stamp) {
  if (auto fine = ready(true); !fine) return pass(std::move(fine).error(), to_string(stream));
  ChunkBuffer& chunk = buffer(stream);
  if (chunk.full() || !chunk.continues(stamp.sequence, stamp.lost))
    if (auto done = guard(write_chunk(chunk)); !done) return pass(std::move(done).error());
  return &chunk;
}

Recorder::Recorder(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Recorder::Recorder(Recorder&&) noexcept = default;
Recorder& Recorder::operator=(Recorder&&) noexcept = default;
Recorder::~Recorder() = default;

Status Recorder::refuse_existing(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return {};
  return fail(Errc::wrong_state, "the campaign file exists already", path.string(), {}, {},
              "Choose another folder or move the file away");
}

Result<Recorder> Recorder::create(const std::filesystem::path& path, const CampaignHeader& header) {
  if (Status free = refuse_existing(path); !free) return pass(free.error());
  auto database = sqlite::Database::open(path, sqlite::Mode::create);
  if (!database) return pass(std::move(database).error());
  Status done = configure(*database);
  if (done) done = database->execute("BEGIN");
  if (done) done = write_header(*database, header);
  if (done) done = write_axes(*database, header.info.axes);
  if (done) done = database->execute("COMMIT");
  auto impl = std::make_unique<Impl>(std::move(*database), header);
  if (done) done = impl->prepare();
  if (!done) return pass(std::move(done).error(), path.string());
  Recorder recorder(std::move(impl));
  for (const DeviceInfo& device : header.info.devices)
    if (auto stored = recorder.device(device); !stored)
      return pass(std::move(stored).error(), path.string());
  return recorder;
}

Status Recorder::device(const DeviceInfo& device) {
  if (impl_->failure) return tl::unexpected<Error>(*impl_->failure);
  if (auto done = impl_->guard(impl_->begin()); !done) return done;
  sqlite::Statement& insert = impl_->insert_device;
  insert.bind(1, device.name).bind(2, device.driver).bind(3, device.identity_json);
  return impl_->guard(insert.run());
}

Status Recorder::begin_trial(const TrialSpec& spec, TimePoint now) {
  if (auto fine = impl_->ready(false); !fine) return fine;
  if (auto done = impl_->guard(impl_->begin()); !done) return done;
  const std::string patch_seed = std::to_string(spec.patch_seed);
  sqlite::Statement& insert = impl_->insert_trial;
  insert.bind(1, std::int64_t{spec.index}).bind(2, std::int64_t{spec.attempt});
  insert.bind(3, spec.label).bind(4, spec.group).bind(5, spec.exploration);
  insert.bind(6, std::int64_t{spec.repetition}).bind(7, patch_seed).bind(8, ns_of(now));
  if (auto done = impl_->guard(insert.run()); !done) return done;
  impl_->trial = impl_->database.last_row_id();
  impl_->next_chunk_number = {};
  return impl_->guard(impl_->commit());
}

Status Recorder::taxel(const Stamp& stamp, const TaxelSample& sample, Phase phase) {
  auto chunk = impl_->open_buffer(Stream::taxel, stamp);
  if (!chunk) return pass(std::move(chunk).error());
  if (sample.counts.size() != (*chunk)->width())
    return fail(Errc::invalid_argument, "a frame with another number of taxels", "taxel",
                std::to_string((*chunk)->width()), std::to_string(sample.counts.size()));
  encode_taxel((*chunk)->slot(), stamp.host, sample, phase);
  (*chunk)->push(stamp.sequence, stamp.lost, stamp.host);
  return {};
}

Status Recorder::wrench(const Stamp& stamp, const WrenchSample& sample) {
  auto chunk = impl_->open_buffer(Stream::wrench, stamp);
  if (!chunk) return pass(std::move(chunk).error());
  if (auto done = encode_wrench((*chunk)->slot(), stamp.host, sample); !done) return done;
  (*chunk)->push(stamp.sequence, stamp.lost, stamp.host);
  return {};
}

Status Recorder::stages(const Stamp& stamp, std::span<const double> positions) {
  auto chunk = impl_->open_buffer(Stream::stages, stamp);
  if (!chunk) return pass(std::move(chunk).error());
  if (positions.size() != impl_->axes.size())
    return fail(Errc::invalid_argument, "another number of axes", "stages",
                std::to_string(impl_->axes.size()), std::to_string(positions.size()));
  if (auto done = encode_stages((*chunk)->slot(), stamp.host, positions, impl_->axes); !done)
    return done;
  (*chunk)->push(stamp.sequence, stamp.lost, stamp.host);
  return {};
}

Status Recorder::end_trial(TrialOutcome outcome, const TrialQuality& quality, TimePoint now) {
  if (auto fine = impl_->ready(true); !fine) return fine;
  Status done = impl_->write_chunks();
  if (done) done = impl_->begin();
  if (!done) return impl_->guard(done);
  sqlite::Statement& update = impl_->update_trial;
  update.bind(1, *impl_->trial).bind(2, to_string(outcome)).bind(3, ns_of(now));
  update.bind(4, quality.force_rms_error_n).bind(5, quality.force_in_band_fraction);
  done = update.run();
  if (done) done = impl_->commit();
  impl_->trial.reset();
  return impl_->guard(done);
}

Status Recorder::journal(TimePoint now, std::string_view kind, std::string_view payload_json) {
  if (impl_->failure) return tl::unexpected<Error>(*impl_->failure);
  if (impl_->finished) return fail(Errc::wrong_state, "the campaign file has been finished");
  if (auto done = impl_->guard(impl_->begin()); !done) return done;
  sqlite::Statement& insert = impl_->insert_journal;
  insert.bind(1, ns_of(now)).bind(2, kind).bind(3, payload_json);
  return impl_->guard(insert.run());
}

Status Recorder::commit_if_due(std::chrono::nanoseconds steady_wall) {
  if (!impl_->last_commit) impl_->last_commit = steady_wall;
  if (steady_wall - *impl_->last_commit < commit_budget) {
    if (impl_->failure) return tl::unexpected<Error>(*impl_->failure);
    return {};
  }
  impl_->last_commit = steady_wall;
  return commit();
}

Status Recorder::commit() {
  if (impl_->failure) return tl::unexpected<Error>(*impl_->failure);
  Status done = impl_->write_chunks();
  if (done) done = impl_->commit();
  return impl_->guard(done);
}

Status Recorder::finish() {
  if (auto fine = impl_->ready(false); !fine) return fine;
  if (auto done = impl_->guard(impl_->begin()); !done) return done;
  Status done = impl_->database.execute("UPDATE campaign SET finished = 1");
  if (done) done = impl_->commit();
  // Without its log the file is one piece that can be copied and read from a read-only place.
  if (done) done = impl_->database.execute("PRAGMA journal_mode=DELETE");
  impl_->finished = done.has_value();
  return impl_->guard(done);
}

}  // namespace weft::daemon
