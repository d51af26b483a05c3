#include "daemon/storage/certificate/certificate.hpp"

#include <future>
#include <nlohmann/json.hpp>

#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/dataset/dataset_hasher.hpp"
#include "daemon/storage/dataset/dataset_writer.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "daemon/storage/recorder/sqlite.hpp"
#include "daemon/storage/recorder/trial_reader.hpp"
#include "protocols/base/json_text.hpp"

namespace weft::daemon {

// JSON keys are the members' names.
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
constexpr int oldest_version = 1;  ///< has checksums of blocks, which are ignored

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

/// Over the complete trials; nothing if none was measured.
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

/// The newest journal entry about a requested accuracy or speed.
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
                   .what = "journal entry \"simulation\" not readable",
                   .got = e.what()});
    }
  }
  return out;
}

/// Names, outcomes and catalogue entries; the digests of the content are added later.
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
                 .what = "campaign file changed while it was read",
                 .hint = "Try again after the run has ended"});
  for (std::size_t i = 0; i < all.trials.size(); ++i)
    out.trials.push_back({all.trials[i].file,
                          std::string(to_string(all.records[i].outcome)),
                          {},
                          (*catalogue)[i].sha256,
                          (*catalogue)[i].gaps});
  return {};
}

/// A campaign that was read once, for both its data set and its certificate.
struct Contents {
  Certificate certificate;  ///< without `files`
  bool is_discarded = false;
};

/// Reads every attempt. `dataset`: the complete ones are also written there; empty: not.
Result<Contents> read_contents(const std::filesystem::path& campaign,
                               const std::filesystem::path& dataset) {
  const auto progress = load_progress(campaign);
  if (!progress) return pass(progress.error());
  Contents out;
  out.is_discarded = progress->discarded;
  std::optional<DatasetHasher> hasher;
  std::optional<DatasetWriter> writer;
  Dataset all;  // without samples
  std::vector<std::string> digests;
  const auto info = visit_attempts(campaign, Attempts::all,
                                   [&](const DatasetInfo& header, TrialData attempt) -> Status {
                                     const auto& [trial, record] = attempt;
                                     if (!hasher) hasher.emplace(header);
                                     if (!writer && !dataset.empty() && !out.is_discarded) {
                                       auto created = DatasetWriter::create(dataset, header);
                                       if (!created) return pass(created.error());
                                       writer.emplace(std::move(*created));
                                     }
                                     all.trials.push_back(without_samples(trial));
                                     all.records.push_back(without_samples(record));
                                     if (record.outcome != TrialOutcome::complete) {
                                       digests.push_back(trial_sha256(trial, record));
                                     } else if (writer) {
                                       auto added = writer->add(trial, record);
                                       if (!added) return pass(added.error());
                                       digests.push_back(std::move(*added));
                                     } else {
                                       digests.push_back(hasher->add(trial, record));
                                     }
                                     return {};
                                   });
  if (!info) return pass(info.error());
  all.info = *info;
  describe(all.info, out.certificate);
  out.certificate.trials_planned = progress->planned;
  auto simulation = simulation_on_record(campaign);
  if (!simulation) return pass(simulation.error());
  out.certificate.simulation = std::move(*simulation);
  if (Status ok = add_trials(campaign, all, out.certificate); !ok) return pass(ok.error());
  for (std::size_t i = 0; i < digests.size(); ++i)
    out.certificate.trials[i].sha256 = std::move(digests[i]);
  if (writer) {
    const auto written = writer->finish(info->ended_early);
    if (!written) return pass(written.error());
    out.certificate.dataset_sha256 = written->dataset_sha256;
  } else {
    if (!hasher) hasher.emplace(*info);
    out.certificate.dataset_sha256 = hasher->finish().dataset_sha256;
  }
  return out;
}

/// Writes the complete trials of a campaign file as a data set.
Status export_complete(const std::filesystem::path& campaign,
                       const std::filesystem::path& dataset) {
  std::optional<DatasetWriter> writer;
  const auto info = visit_attempts(campaign, Attempts::complete,
                                   [&](const DatasetInfo& header, TrialData attempt) -> Status {
                                     if (!writer) {
                                       auto created = DatasetWriter::create(dataset, header);
                                       if (!created) return pass(created.error());
                                       writer.emplace(std::move(*created));
                                     }
                                     const auto added = writer->add(attempt.trial, attempt.record);
                                     if (!added) return pass(added.error());
                                     return {};
                                   });
  if (!info) return pass(info.error());
  if (!writer)
    return fail({.code = Errc::not_found,
                 .where = campaign.string(),
                 .what = "no complete trial in the campaign"});
  const auto written = writer->finish(info->ended_early);
  if (!written) return pass(written.error());
  return {};
}

/// A campaign that cannot be certified is still exported if its complete trials can be read.
Result<std::string> export_uncertified(const std::filesystem::path& campaign,
                                       const std::filesystem::path& dataset, const Error& why) {
  if (const auto written = export_complete(campaign, dataset); !written)
    return pass(written.error());
  return pass(why, "certificate");
}

Status add_file(Result<FileChecksums> checksums, Certificate& out) {
  if (!checksums) return pass(checksums.error());
  out.files.push_back(std::move(*checksums));
  return {};
}

}  // namespace

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
    return fail({.code = Errc::parse, .what = "not a Weft certificate"});
  const std::string recorded = object[own_digest];
  object.erase(own_digest);
  // Text that is not UTF-8 does not parse, so dump() cannot fail.
  if (const std::string found = sha256_hex(object.dump()); found != recorded)
    return fail({.code = Errc::corrupt,
                 .what = "certificate altered, wrong digest",
                 .expected = recorded,
                 .got = found});
  try {
    const json& version = object.at("version");
    if (object.at("format") != "weft-certificate" ||
        (version != certificate_version && version != oldest_version))
      return fail({.code = Errc::unsupported,
                   .what = "unsupported certificate version",
                   .expected = std::to_string(certificate_version),
                   .got = version.dump()});
    Certificate out = object;
    out.ended_early = object.value("ended_early", out.ended_early);  // usually absent
    if (object.contains("rest")) out.rest = object.at("rest").get<CertifiedRest>();
    if (object.contains("simulation"))
      out.simulation = object.at("simulation").get<CertifiedSimulation>();
    return out;
  } catch (const json::exception& e) {
    return fail({.code = Errc::parse, .what = "not a Weft certificate", .got = e.what()});
  }
}

Result<FileChecksums> file_checksums(const std::filesystem::path& file,
                                     const StopRequested& stop_requested) {
  constexpr std::size_t block_bytes = std::size_t{1} << 16;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    return fail({.code = Errc::not_found, .where = file.string(), .what = "no such file"});
  FileChecksums checksums{file.filename().string(), 0, {}};
  const auto in = sqlite::RawFile::open(file);  // not std::ifstream: this process may have the file
                                                // open for writing
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
  auto contents = read_contents(campaign, {});
  if (!contents) return pass(contents.error());
  Certificate& out = contents->certificate;
  if (dataset.empty()) out.dataset_sha256.clear();
  if (Status ok = add_file(file_checksums(campaign), out); !ok) return pass(ok.error());
  if (dataset.empty()) return std::move(out);
  if (Status ok = add_file(file_checksums(dataset), out); !ok) return pass(ok.error());
  return std::move(out);
}

Status write_certificate(const std::filesystem::path& campaign,
                         const std::filesystem::path& dataset) {
  const auto certificate = certify(campaign, dataset);
  if (!certificate) return pass(certificate.error(), "certificate");
  return write_text_file(campaign.parent_path() / certificate_file_name, to_json(*certificate));
}

Result<std::string> export_certified(const std::filesystem::path& campaign,
                                     const std::filesystem::path& dataset) {
  auto checksums = std::async(std::launch::async, [&] { return file_checksums(campaign); });
  auto contents = read_contents(campaign, dataset);
  if (!contents) return export_uncertified(campaign, dataset, contents.error());
  if (contents->is_discarded)
    return export_uncertified(campaign, dataset, {});  // export_uncertified()
                                                       // refuses it
  Certificate& certificate = contents->certificate;
  Status ok = add_file(checksums.get(), certificate);
  if (ok) ok = add_file(file_checksums(dataset), certificate);
  if (!ok) return pass(ok.error(), "certificate");
  ok = write_text_file(campaign.parent_path() / certificate_file_name, to_json(certificate));
  if (!ok) return pass(ok.error());
  return certificate.dataset_sha256;
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
