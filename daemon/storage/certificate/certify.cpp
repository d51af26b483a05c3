#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/storage/certificate/catalogue_digest.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/recorder/recorder.hpp"
#include "daemon/storage/recorder/sqlite.hpp"

namespace weft::daemon {
namespace {

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
  auto all = load_campaign(campaign, {.all_outcomes = true, .streams = true, .transfers = false});
  if (!all) return pass(all.error());
  Certificate out;
  describe(all->info, out);
  out.trials_planned = progress->planned;
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
