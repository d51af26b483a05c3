#include "daemon/storage/certificate/certificate.hpp"

#include <array>
#include <nlohmann/json.hpp>

#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/recorder/chunk.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "daemon/storage/recorder/schema.hpp"
#include "daemon/storage/recorder/sqlite.hpp"
#include "protocols/base/json_text.hpp"

namespace weft::daemon {

// Members as their names.
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DeviceInfo, name, driver, identity_json)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(EndedEarly, label, exploration, trials)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CertifiedGap, stream, before_sequence, lost)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CertifiedTrial, name, outcome, sha256, catalogue_sha256, gaps)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CertifiedTable, name, sha256)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CertifiedRest, weight_n, trials, worst_before_n, worst_after_n,
                                   worst_trial)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(FileChecksums, name, bytes, sha256)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Certificate, bench_kind, name, seed, software_version,
                                   recipe_sha256, rig_sha256, trials_planned, dataset_sha256,
                                   devices, trials, tables, files)

namespace {

using nlohmann::json;

constexpr const char* own_digest = "certificate_sha256";
constexpr int certificate_version = 2;
constexpr int oldest_version = 1;  ///< with checksums of blocks, which are passed over

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
  bool is_optional = false;  ///< only in campaigns with vibrations, or of a sweep
};

// Reals as their 17 digits: SQLite's own text of them has 15.
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

void describe(const DatasetInfo& info, Certificate& out) {
  out.bench_kind = to_string(info.kind);
  out.name = info.name;
  out.seed = std::to_string(info.seed);
  out.software_version = info.software_version;
  out.recipe_sha256 = info.recipe_sha256;
  out.rig_sha256 = info.rig_sha256;
  out.devices = info.devices;
  out.ended_early = info.ended_early;
}

/// Over the complete trials; nothing where none was measured.
std::optional<CertifiedRest> worst_rest(const Dataset& all) {
  CertifiedRest out;
  double furthest_n = -1;
  for (std::size_t i = 0; i < all.trials.size(); ++i) {
    const auto& rest = all.records[i].quality.rest;
    if (!rest || all.records[i].outcome != TrialOutcome::complete) continue;
    if (!std::isfinite(rest->before_n) || !std::isfinite(rest->after_n)) continue;
    if (out.trials++ == 0) out.worst_before_n = out.worst_after_n = out.weight_n = rest->weight_n;
    const auto see = [&](double force_n, double& worst_n) {
      const double off_n = std::abs(force_n - rest->weight_n);
      if (off_n > std::abs(worst_n - rest->weight_n)) worst_n = force_n;
      if (off_n > furthest_n) {
        furthest_n = off_n;
        out.worst_trial = all.trials[i].file;
      }
    };
    see(rest->before_n, out.worst_before_n);
    see(rest->after_n, out.worst_after_n);
  }
  return out.trials > 0 ? std::optional(out) : std::nullopt;
}

/// What the campaign's journal says last of an accuracy or a speed that was asked for.
Result<std::optional<CertifiedSimulation>> simulation_on_record(
    const std::filesystem::path& campaign) {
  const auto journal = load_journal(campaign);
  if (!journal) return pass(journal.error());
  std::optional<CertifiedSimulation> out;
  for (const JournalEntry& entry : *journal) {
    if (entry.kind != "simulation") continue;
    try {
      auto found = json::parse(entry.payload_json).get<CertifiedSimulation>();
      out.reset();
      if (found.promise || found.budget) out = std::move(found);
    } catch (const json::exception& e) {
      return fail({.code = Errc::parse,
                   .where = campaign.string(),
                   .what = "the journal's line on the simulation cannot be read",
                   .got = e.what()});
    }
  }
  return out;
}

/// Keeps what is for training, as the data set does.
Dataset select_complete(Dataset&& all) {
  Dataset out;
  out.info = std::move(all.info);
  for (std::size_t i = 0; i < all.trials.size(); ++i) {
    if (all.records[i].outcome != TrialOutcome::complete) continue;
    out.trials.push_back(std::move(all.trials[i]));
    out.records.push_back(std::move(all.records[i]));
  }
  return out;
}

Status add_trials(const std::filesystem::path& campaign, const Dataset& all, Certificate& out) {
  auto database = sqlite::Database::open(campaign, sqlite::Mode::read_only);
  if (!database) return pass(database.error());
  auto tables = table_digests(*database);
  if (!tables) return pass(tables.error(), campaign.string());
  out.tables = std::move(*tables);
  out.rest = worst_rest(all);
  const auto catalogue = catalogued_trials(*database);
  if (!catalogue) return pass(catalogue.error(), campaign.string());
  if (catalogue->size() != all.trials.size())
    return fail({.code = Errc::wrong_state,
                 .where = campaign.string(),
                 .what = "the campaign file changes while it is read"});
  for (std::size_t i = 0; i < all.trials.size(); ++i)
    out.trials.push_back({all.trials[i].file, std::string(to_string(all.records[i].outcome)),
                          trial_sha256(all.trials[i], all.records[i]), (*catalogue)[i].sha256,
                          (*catalogue)[i].gaps});
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

std::string to_json(const Certificate& certificate) {
  json out = certificate;
  out["format"] = "weft-certificate";
  out["version"] = certificate_version;
  if (!certificate.ended_early.empty()) out["ended_early"] = certificate.ended_early;
  if (certificate.rest) out["rest"] = *certificate.rest;
  if (certificate.simulation) out["simulation"] = *certificate.simulation;
  out[own_digest] = sha256_hex(out.dump());
  return out.dump(1) + "\n";
}

Result<Certificate> certificate_from_json(const std::string& text) {
  auto document = parse_json(text);
  if (!document) return pass(document.error());
  json& object = *document;
  if (!object.is_object() || !object.contains(own_digest) || !object[own_digest].is_string())
    return fail({.code = Errc::parse, .what = "not a certificate of Weft"});
  const std::string recorded = object[own_digest];
  object.erase(own_digest);
  // Text that is no UTF-8 cannot be dumped, nor does it parse.
  if (const std::string found = sha256_hex(object.dump()); found != recorded)
    return fail({.code = Errc::corrupt,
                 .what = "the certificate itself was altered: its digest disagrees",
                 .expected = recorded,
                 .got = found});
  try {
    const json& version = object.at("version");
    if (object.at("format") != "weft-certificate" ||
        (version != certificate_version && version != oldest_version))
      return fail({.code = Errc::unsupported,
                   .what = "a certificate of another layout",
                   .expected = std::to_string(certificate_version)});
    Certificate out = object;
    out.ended_early = object.value("ended_early", out.ended_early);  // as a rule there are none
    if (object.contains("rest")) out.rest = object.at("rest").get<CertifiedRest>();
    if (object.contains("simulation"))
      out.simulation = object.at("simulation").get<CertifiedSimulation>();
    return out;
  } catch (const json::exception& e) {
    return fail({.code = Errc::parse, .what = "not a certificate of Weft", .got = e.what()});
  }
}

Result<FileChecksums> file_checksums(const std::filesystem::path& file,
                                     const StopRequested& stop_requested) {
  constexpr std::size_t block_bytes = std::size_t{1} << 16;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    return fail({.code = Errc::not_found, .where = file.string(), .what = "no such file"});
  FileChecksums checksums{file.filename().string(), 0, {}};
  const auto in = sqlite::RawFile::open(file);  // this process may be writing it
  if (!in) return pass(in.error());
  Bytes block(block_bytes);
  Sha256 hash;
  while (true) {
    const auto got = in->read(checksums.bytes, block);
    if (!got) return pass(got.error(), file.string());
    if (*got == 0) break;
    if (stop_requested && stop_requested()) return pass(stopped_early(file.string()));
    hash.update(ByteView(block).first(*got));
    checksums.bytes += *got;
  }
  checksums.sha256 = to_hex(hash.finish());
  return checksums;
}

Result<Certificate> certify(const std::filesystem::path& campaign,
                            const std::filesystem::path& dataset) {
  const auto progress = load_progress(campaign);
  if (!progress) return pass(progress.error());
  auto all = load_campaign(campaign, {.all_outcomes = true});
  if (!all) return pass(all.error());
  Certificate out;
  describe(all->info, out);
  out.trials_planned = progress->planned;
  auto simulation = simulation_on_record(campaign);
  if (!simulation) return pass(simulation.error());
  out.simulation = std::move(*simulation);
  if (Status ok = add_trials(campaign, *all, out); !ok) return pass(ok.error());
  auto checksums = file_checksums(campaign);
  if (!checksums) return pass(checksums.error());
  out.files.push_back(std::move(*checksums));
  if (dataset.empty()) return out;
  out.dataset_sha256 = dataset_sha256(select_complete(std::move(*all)));
  auto exported = file_checksums(dataset);
  if (!exported) return pass(exported.error());
  out.files.push_back(std::move(*exported));
  return out;
}

Status write_certificate(const std::filesystem::path& campaign,
                         const std::filesystem::path& dataset) {
  const auto certificate = certify(campaign, dataset);
  if (!certificate) return pass(certificate.error(), "certificate");
  return write_text_file(campaign.parent_path() / certificate_file_name, to_json(*certificate));
}

Result<std::optional<Certificate>> read_certificate(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / certificate_file_name;
  std::error_code ignored;
  if (!std::filesystem::exists(file, ignored)) return std::optional<Certificate>{};
  const auto text = read_text_file(file, most_list_bytes);
  if (!text) return pass(text.error());
  auto certificate = certificate_from_json(*text);
  if (!certificate) return pass(certificate.error(), file.string());
  return std::optional(std::move(*certificate));
}

}  // namespace weft::daemon
