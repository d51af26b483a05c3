// Campaign file to Dataset. The file may come from a killed process or a failing disk, so all
// content is checked before use.
#include <algorithm>
#include <array>
#include <charconv>
#include <map>
#include <utility>

#include "daemon/storage/recorder/chunk.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "daemon/storage/recorder/schema.hpp"
#include "daemon/storage/recorder/sqlite.hpp"
#include "daemon/storage/recorder/trial_reader.hpp"
#include "drivers/api/sample.hpp"
#include "protocols/base/bytes.hpp"

namespace weft::daemon {
namespace {

Result<std::int64_t> read_integer(sqlite::Database& database, const char* sql) {
  const auto found = database.integer(sql);
  if (!found) return pass(found.error());
  if (!*found) return fail({.code = Errc::corrupt, .what = "header row of the campaign missing"});
  return **found;
}

Result<sqlite::Database> open_campaign(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored))
    return fail({.code = Errc::not_found, .where = path, .what = "campaign file not found"});
  auto database = sqlite::Database::open(path, sqlite::Mode::read_only);
  if (!database) return database;
  const auto identity = read_integer(*database, "PRAGMA application_id");
  if (!identity) return pass(identity.error(), path.string());
  if (*identity != campaign_application_id)
    return fail({.code = Errc::parse, .where = path, .what = "not a Weft campaign file"});
  const auto version = read_integer(*database, "PRAGMA user_version");
  if (!version) return pass(version.error(), path.string());
  if (*version != campaign_schema_version)
    return fail({.code = Errc::unsupported,
                 .where = path,
                 .what = "unsupported campaign file version",
                 .expected = std::to_string(campaign_schema_version),
                 .got = std::to_string(*version)});
  return database;
}

Result<bool> is_discarded(sqlite::Database& database) {
  const auto lines =
      database.integer("SELECT count(*) FROM journal WHERE kind = ?", discarded_kind);
  if (!lines) return pass(lines.error());
  return lines->value_or(0) > 0;
}

/// Streams of blocks, if the file has any.
Status read_block_streams(sqlite::Database& database, DatasetInfo& info) {
  const auto tables = database.integer(has_table_sql, "block_stream");
  if (!tables) return pass(tables.error());
  if (!*tables) return {};
  return database.each("SELECT stream, rate_hz, readings FROM block_stream",
                       [&](const sqlite::Statement& row) -> Status {
                         const std::int64_t readings = row.integer(2);
                         if (readings < 1 || readings > most_block_values || !(row.real(1) > 0))
                           return fail({.code = Errc::corrupt,
                                        .where = "block_stream",
                                        .what = "block format out of range"});
                         const bool sound =
                             row.integer(0) == static_cast<std::int64_t>(Stream::sound);
                         (sound ? info.sound : info.acceleration) = {
                             row.real(1), static_cast<std::uint32_t>(readings)};
                         return {};
                       });
}

std::uint64_t unsigned_of(const std::string& text) {
  std::uint64_t value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

/// The single row of table campaign, with axes and devices. Returns the number of taxels.
Result<std::size_t> read_header(sqlite::Database& database, DatasetInfo& info) {
  auto query = database.prepare(
      "SELECT bench_kind, name, source, recipe_json, recipe_sha256, rig_json, rig_sha256, seed, "
      "software_version, taxels, taxel_rate_hz, wrench_rate_hz, stage_rate_hz FROM campaign");
  if (!query) return pass(std::move(query).error());
  auto row = query->step();
  if (!row) return pass(std::move(row).error());
  if (!*row) return fail({.code = Errc::corrupt, .what = "header row of the campaign missing"});
  const auto kind = bench_kind_from(query->text(0));
  if (!kind)
    return fail({.code = Errc::corrupt,
                 .where = "campaign",
                 .what = "unknown bench kind",
                 .got = query->text(0)});
  const std::int64_t taxels = query->integer(9);
  if (taxels < 0 || taxels > most_taxels)
    return fail({.code = Errc::corrupt,
                 .where = "campaign",
                 .what = "number of taxels out of range",
                 .got = std::to_string(taxels)});
  info.kind = *kind;
  info.name = query->text(1);
  info.source = query->text(2);
  info.recipe_json = query->text(3);
  info.recipe_sha256 = query->text(4);
  info.rig_json = query->text(5);
  info.rig_sha256 = query->text(6);
  info.seed = unsigned_of(query->text(7));
  info.software_version = query->text(8);
  info.taxel_rate_hz = query->real(10);
  info.wrench_rate_hz = query->real(11);
  info.stage_rate_hz = query->real(12);
  Status done = database.each("SELECT name, rotary FROM axis ORDER BY position",
                              [&](const sqlite::Statement& axis) {
                                info.axes.push_back({axis.text(0), axis.integer(1) != 0});
                              });
  if (done)
    done = database.each("SELECT name, driver, identity_json FROM device ORDER BY rowid",
                         [&](const sqlite::Statement& device) {
                           info.devices.push_back({device.text(0), device.text(1), device.text(2)});
                         });
  if (!done) return pass(done.error());
  return static_cast<std::size_t>(taxels);
}

std::optional<double> real_or_nothing(const sqlite::Statement& query, int column) {
  if (query.is_null(column)) return std::nullopt;
  return query.real(column);
}

/// Names of a sweep's factors, if the file has any.
Status read_factor_names(sqlite::Database& database, DatasetInfo& info) {
  const auto tables = database.integer(has_table_sql, "factor");
  if (!tables) return pass(tables.error());
  if (!*tables) return {};
  return database.each("SELECT name FROM factor ORDER BY position",
                       [&](const sqlite::Statement& row) { info.factors.push_back(row.text(0)); });
}

/// Factor values by trial id; empty without a sweep.
Result<std::map<std::int64_t, std::vector<double>>> read_factor_values(sqlite::Database& database,
                                                                       const DatasetInfo& info) {
  std::map<std::int64_t, std::vector<double>> out;
  if (info.factors.empty()) return out;
  const Status done = database.each(
      "SELECT trial, value FROM trial_factor ORDER BY trial, position",
      [&](const sqlite::Statement& row) { out[row.integer(0)].push_back(row.real(1)); });
  if (!done) return pass(done.error());
  return out;
}

/// Reads a table with one row per trial, by trial id; empty if an older file lacks the table.
/// `sql`: selects its rows, with the trial in the first column.
template <class Value>
Result<std::map<std::int64_t, Value>> read_by_trial(sqlite::Database& database, const char* table,
                                                    const char* sql,
                                                    Value (*read)(const sqlite::Statement& row)) {
  std::map<std::int64_t, Value> out;
  const auto tables = database.integer(has_table_sql, table);
  if (!tables) return pass(tables.error());
  if (!*tables) return out;
  const Status done =
      database.each(sql, [&](const sqlite::Statement& row) { out[row.integer(0)] = read(row); });
  if (!done) return pass(done.error());
  return out;
}

TrialPlace place_of(const sqlite::Statement& row) {
  const auto number = [&](int column) { return static_cast<std::uint32_t>(row.integer(column)); };
  return {number(1), number(2), number(3)};
}

RestForces rest_of(const sqlite::Statement& row) {
  constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
  return {row.real(1), real_or_nothing(row, 2).value_or(unknown),
          real_or_nothing(row, 3).value_or(unknown)};
}

/// One row of the trial table, without samples. A trial without an end was interrupted.
Result<TrialRecord> read_trial_row(const sqlite::Statement& query) {
  TrialRecord record;
  record.spec.index = static_cast<std::uint32_t>(query.integer(1));
  record.spec.attempt = static_cast<std::uint32_t>(query.integer(2));
  record.spec.label = query.text(3);
  record.spec.group = query.text(4);
  record.spec.exploration = query.text(5);
  record.spec.repetition = static_cast<std::uint32_t>(query.integer(6));
  record.spec.patch_seed = unsigned_of(query.text(7));
  const auto outcome =
      query.is_null(8) ? TrialOutcome::interrupted : trial_outcome_from(query.text(8));
  if (!outcome)
    return fail({.code = Errc::corrupt,
                 .where = trial_name(record.spec),
                 .what = "unknown outcome",
                 .got = query.text(8)});
  record.outcome = *outcome;
  record.quality.force_rms_error_n = real_or_nothing(query, 9);
  record.quality.force_in_band_fraction = real_or_nothing(query, 10);
  return record;
}

/// Reads the chunks of one trial after another with one prepared statement.
class ChunkReader {
 public:
  static Result<ChunkReader> prepare(sqlite::Database& database, std::size_t taxels,
                                     const DatasetInfo& info, Stream last) {
    auto query = database.prepare(
        "SELECT stream, number, rows, lost_before, crc32, data FROM chunk WHERE trial = ? "
        "AND stream <= ? ORDER BY stream, number");
    if (!query) return pass(std::move(query).error());
    return ChunkReader(std::move(*query), last,
                       {taxels, 6, info.axes.size(), info.acceleration.readings * acceleration_axes,
                        std::size_t{info.sound.readings}});
  }

  Status read(std::int64_t trial_id, classifier::Trial& trial, TrialRecord& record) {
    std::array<std::int64_t, stream_count> expected_number{};
    return query_.bind_all(trial_id, static_cast<std::int64_t>(last_))
        .each([&](const sqlite::Statement& row) -> Status {
          const std::int64_t stream = row.integer(0);
          if (stream < 0 || stream >= std::int64_t{stream_count})
            return fail({.code = Errc::corrupt, .what = "chunk of an unknown stream"});
          const std::string where =
              std::string(to_string(static_cast<Stream>(stream))) + " chunk " + row.text(1);
          if (row.integer(1) != expected_number[static_cast<std::size_t>(stream)]++)
            return fail({.code = Errc::corrupt, .where = where, .what = "previous chunk missing"});
          auto done = decode(static_cast<Stream>(stream), trial, record);
          if (!done) return pass(std::move(done).error(), where);
          return {};
        });
  }

 private:
  using Widths = std::array<std::size_t, stream_count>;  ///< by Stream

  ChunkReader(sqlite::Statement query, Stream last, const Widths& widths)
      : query_(std::move(query)), last_(last), widths_(widths) {}

  Status decode(Stream stream, classifier::Trial& trial, TrialRecord& record) {
    const ByteView data = query_.blob(5);
    const std::size_t width = widths_[static_cast<std::size_t>(stream)];
    if (width == 0 && stream != Stream::stages && stream != Stream::taxel)
      return fail({.code = Errc::corrupt, .what = "chunk of a stream without description"});
    const std::size_t row = row_bytes(stream, width);
    if (data.empty() || data.size() % row != 0 ||
        std::cmp_not_equal(data.size() / row, query_.integer(2)))
      return fail({.code = Errc::corrupt,
                   .what = "chunk truncated",
                   .expected = query_.text(2) + " rows of " + std::to_string(row) + " bytes",
                   .got = std::to_string(data.size()) + " bytes"});
    if (crc32(data) != query_.integer(4))
      return fail({.code = Errc::corrupt, .what = "chunk altered, CRC-32 differs"});
    const auto lost = static_cast<std::uint32_t>(query_.integer(3));
    switch (stream) {
      case Stream::wrench:
        decode_wrench(data, record.wrench);
        return {};
      case Stream::stages:
        decode_stages(data, width, record.stages);
        return {};
      case Stream::acceleration:
        decode_blocks(data, width, lost, record.acceleration);
        return {};
      case Stream::sound:
        decode_blocks(data, width, lost, record.sound);
        return {};
      case Stream::taxel:
        break;
    }
    record.lost_samples += lost;
    if (!decode_taxels(data, trial, record))
      return fail({.code = Errc::corrupt, .what = "unknown phase"});
    return {};
  }

  sqlite::Statement query_;
  Stream last_;
  Widths widths_;
};

/// Selects all attempts, or the complete ones only.
struct WantedTrials : AttemptSelection {
  bool all_outcomes = true;
};

/// Reads the samples of the attempt, or only the number of lost taxel frames.
Status read_samples(sqlite::Database& database, const WantedTrials& wanted, std::int64_t id,
                    ChunkReader& chunks, classifier::Trial& trial, TrialRecord& record) {
  if (wanted.has_samples) return chunks.read(id, trial, record);
  auto query =
      database.prepare("SELECT sum(lost_before) FROM chunk WHERE trial = ? AND stream = 0");
  if (!query) return pass(std::move(query).error());
  return query->bind_all(id).each([&](const sqlite::Statement& row) {
    record.lost_samples = static_cast<std::uint32_t>(row.integer(0));
  });
}

/// Adds `ended_early` to `info` at the end.
Status read_trials(sqlite::Database& database, const WantedTrials& options, std::size_t taxels,
                   DatasetInfo& info, const AttemptVisitor& visitor) {
  auto chunks = ChunkReader::prepare(database, taxels, info, options.last_stream);
  if (!chunks) return pass(std::move(chunks).error());
  auto factors = read_factor_values(database, info);
  if (!factors) return pass(std::move(factors).error());
  const auto places = read_by_trial(
      database, "trial_place", "SELECT trial, piece, mounting, patch FROM trial_place", &place_of);
  if (!places) return pass(places.error());
  const auto rests =
      read_by_trial(database, "trial_rest",
                    "SELECT trial, weight_n, before_n, after_n FROM trial_rest", &rest_of);
  if (!rests) return pass(rests.error());
  std::map<std::pair<std::string, std::string>, std::uint32_t> ended_early;
  const auto read_trial = [&](const sqlite::Statement& row) -> Status {
    auto record = read_trial_row(row);
    if (!record) return pass(std::move(record).error());
    const TrialSpec& spec = record->spec;
    if (const auto place = places->find(row.integer(0)); place != places->end())
      record->spec.place = place->second;
    if (const auto rest = rests->find(row.integer(0)); rest != rests->end())
      record->quality.rest = rest->second;
    record->spec.factors = std::move((*factors)[row.integer(0)]);
    if (spec.factors.size() != info.factors.size())
      return fail({.code = Errc::corrupt,
                   .where = trial_name(spec),
                   .what = "wrong number of factor values",
                   .expected = std::to_string(info.factors.size()),
                   .got = std::to_string(spec.factors.size())});
    if (record->outcome == TrialOutcome::ended_early) ++ended_early[{spec.label, spec.exploration}];
    if (record->outcome != TrialOutcome::complete && !options.all_outcomes) return {};
    if (!options.name.empty() && trial_name(spec) != options.name) return {};
    if (options.stop_requested && options.stop_requested())
      return pass(stopped_early(trial_name(spec)));
    classifier::Trial trial;
    trial.file = trial_name(spec);
    trial.label = spec.label;
    trial.group = spec.group;
    trial.taxels = taxels;
    auto done = read_samples(database, options, row.integer(0), *chunks, trial, *record);
    if (!done) return pass(std::move(done).error(), "trial " + trial.file);
    return visitor(info, {std::move(trial), std::move(*record)});
  };
  auto rows = database.prepare(
      "SELECT id, plan_index, attempt, label, trial_group, exploration, repetition, patch_seed, "
      "outcome, force_rms_error_n, force_in_band_fraction FROM trial ORDER BY plan_index, attempt "
      "LIMIT ? OFFSET ?");
  if (!rows) return pass(std::move(rows).error());
  Status done = rows->bind_all(static_cast<std::int64_t>(options.most),
                               static_cast<std::int64_t>(options.from))
                    .each(read_trial);
  for (const auto& [what, trials] : ended_early)
    info.ended_early.push_back({what.first, what.second, trials});
  return done;
}

Result<DatasetInfo> visit_trials(const std::filesystem::path& path, const WantedTrials& wanted,
                                 const AttemptVisitor& visitor) {
  auto database = open_campaign(path);
  if (!database) return pass(std::move(database).error());
  const auto discarded = is_discarded(*database);
  if (!discarded) return pass(discarded.error(), path.string());
  if (*discarded && !wanted.all_outcomes)
    return fail({.code = Errc::wrong_state,
                 .where = path,
                 .what = "campaign discarded, it has no data set"});
  DatasetInfo info;
  auto taxels = read_header(*database, info);
  if (!taxels) return pass(std::move(taxels).error(), path.string());
  Status done = read_block_streams(*database, info);
  if (done) done = read_factor_names(*database, info);
  if (done) done = read_trials(*database, wanted, *taxels, info, visitor);
  if (!done) return pass(std::move(done).error(), path.string());
  return info;
}

Result<Dataset> load_trials(const std::filesystem::path& path, const WantedTrials& wanted) {
  Dataset dataset;
  auto info = visit_trials(path, wanted, [&](const DatasetInfo&, TrialData attempt) -> Status {
    dataset.trials.push_back(std::move(attempt.trial));
    dataset.records.push_back(std::move(attempt.record));
    return {};
  });
  if (!info) return pass(std::move(info).error());
  dataset.info = std::move(*info);
  return dataset;
}

}  // namespace

Result<Dataset> load_campaign(const std::filesystem::path& path,
                              const CampaignLoadOptions& options) {
  WantedTrials wanted{{.stop_requested = options.stop_requested}, options.all_outcomes};
  return load_trials(path, wanted);
}

Result<Dataset> load_attempts(const std::filesystem::path& path,
                              const AttemptSelection& selection) {
  return load_trials(path, {selection});
}

Result<DatasetInfo> visit_attempts(const std::filesystem::path& path, Attempts which,
                                   const AttemptVisitor& visitor,
                                   const StopRequested& stop_requested) {
  return visit_trials(path, {{.stop_requested = stop_requested}, which == Attempts::all}, visitor);
}

Result<CampaignHeader> load_header(const std::filesystem::path& path) {
  auto database = open_campaign(path);
  if (!database) return pass(std::move(database).error());
  CampaignHeader header;
  auto taxels = read_header(*database, header.info);
  if (!taxels) return pass(std::move(taxels).error(), path.string());
  header.taxels = *taxels;
  const auto planned = read_integer(*database, "SELECT trials_planned FROM campaign");
  if (!planned) return pass(planned.error(), path.string());
  header.trials_planned = static_cast<std::uint32_t>(*planned);
  const auto created = read_integer(*database, "SELECT created_utc_ns FROM campaign");
  if (!created) return pass(created.error(), path.string());
  header.created_utc_ns = *created;
  return header;
}

bool is_campaign_file(const std::filesystem::path& path) {
  constexpr std::string_view magic("SQLite format 3\0", 16);
  std::array<std::uint8_t, magic.size()> begin{};
  const auto file = sqlite::RawFile::open(path);
  return file && file->fill(0, begin) && std::equal(begin.begin(), begin.end(), magic.begin());
}

Result<CampaignProgress> load_progress(const std::filesystem::path& path) {
  auto database = open_campaign(path);
  if (!database) return pass(std::move(database).error());
  const auto planned = read_integer(*database, "SELECT trials_planned FROM campaign");
  if (!planned) return pass(planned.error(), path.string());
  const auto finished = read_integer(*database, "SELECT finished FROM campaign");
  if (!finished) return pass(finished.error(), path.string());
  const auto discarded = is_discarded(*database);
  if (!discarded) return pass(discarded.error(), path.string());
  const auto done = read_integer(*database,
                                 "SELECT count(DISTINCT plan_index) FROM trial "
                                 "WHERE outcome IN ('complete', 'ended_early')");
  if (!done) return pass(done.error(), path.string());
  return CampaignProgress{static_cast<std::uint32_t>(*planned), *finished != 0, *discarded,
                          static_cast<std::uint32_t>(*done)};
}

Result<std::vector<JournalEntry>> load_journal(const std::filesystem::path& path) {
  auto database = open_campaign(path);
  if (!database) return pass(std::move(database).error());
  std::vector<JournalEntry> entries;
  const Status done =
      database->each("SELECT sequence, t_ns, kind, payload_json FROM journal ORDER BY sequence",
                     [&](const sqlite::Statement& row) {
                       entries.push_back({row.integer(0), TimePoint(Duration(row.integer(1))),
                                          row.text(2), row.text(3)});
                     });
  if (!done) return pass(done.error(), path.string());
  return entries;
}

}  // namespace weft::daemon
