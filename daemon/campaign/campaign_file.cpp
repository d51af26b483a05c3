#include "daemon/campaign/campaign_file.hpp"

#include <nlohmann/json.hpp>

#include "daemon/base/file/atomic_file.hpp"
#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/recorder/campaign_folder.hpp"
#include "daemon/storage/recorder/campaign_writer.hpp"

namespace weft::daemon {
namespace {

constexpr std::uintmax_t most_plugin_bytes = std::uintmax_t{1} << 28;

/// Records the code of a driver that is not part of this program.
Status record_plugin(Recorder& recorder, const DeviceEntry& entry, DriverCatalog& drivers) {
  const Result<DriverSource> source = drivers.source(entry.driver);
  if (!source || source->file.empty()) return {};
  const Result<std::string> bytes = read_file(source->file, most_plugin_bytes);
  const nlohmann::json line{{"device", entry.name},
                            {"driver", entry.driver},
                            {"file", source->file},
                            {"fingerprint", source->fingerprint},
                            {"sha256", bytes ? sha256_hex(*bytes) : to_string(bytes.error())}};
  return recorder.journal(TimePoint{}, "plugin", line.dump());
}

/// UTC of the loop's zero, so that a file can be aligned with other records.
Status record_clock(Recorder& recorder, const Loop& loop) {
  return recorder.journal(loop.now(), "clock",
                          nlohmann::json{{"utc_ns", utc_now().count()}}.dump());
}

/// Records the identity of each device and the code of each driver from a plugin.
Status record_devices(Recorder& recorder, const Bench& bench, DriverCatalog& drivers) {
  for (const auto& device : bench.devices()) {
    const DeviceEntry& entry = device->entry();
    if (Status ok = recorder.device({entry.name, entry.driver, to_json(device->identity())}); !ok)
      return ok;
    if (Status ok = record_plugin(recorder, entry, drivers); !ok) return ok;
  }
  return {};
}

CampaignHeader make_header(const CheckedRequest& checked, const RigFile& rig) {
  const recipes::Plan& plan = checked.plan;
  CampaignHeader header;
  header.info.kind = rig.bench;
  header.info.name = plan.name;
  header.info.source = "campaign";
  header.info.recipe_json = checked.recipe_text;
  header.info.rig_json = checked.rig_text;
  header.info.seed = plan.seed;
  header.info.software_version = software_version();
  header.info.taxel_rate_hz = plan.limits.taxel_rate_hz;
  header.info.wrench_rate_hz = plan.limits.wrench_rate_hz;
  header.info.stage_rate_hz = plan.limits.stage_rate_hz();
  for (const StageAxis axis : recipes::all_axes)
    header.info.axes.push_back({std::string(recipes::to_string(axis)), !recipes::is_linear(axis)});
  if (plan.sweep)
    for (const recipes::Factor& factor : plan.sweep->factors)
      header.info.factors.emplace_back(recipes::factor_name(factor.kind));
  header.taxels = plan.limits.taxels;
  header.trials_planned = static_cast<std::uint32_t>(plan.trials.size());
  header.created_utc_ns = utc_now().count();
  return header;
}

}  // namespace

Status forget_end(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::remove(folder / certificate_file_name, error);
  const std::filesystem::path dataset = folder / dataset_file_name;
  if (const auto aside = name_aside(dataset); !error && !aside.empty())
    std::filesystem::rename(dataset, folder / aside, error);
  if (error)
    return fail({.code = Errc::io,
                 .where = folder.string(),
                 .what = "certificate and data set not renamed",
                 .got = error.message()});
  return sync_folder(folder);  // before the campaign resumes: the old end must not reappear
}

Result<Recorder> created(const std::filesystem::path& file, const SettledRequest& settled,
                         BenchSession& session) {
  const CheckedRequest& checked = settled.checked;
  const RigFile& rig = settled.rig;
  const auto aside = set_aside(file);
  if (!aside) return pass(aside.error());
  if (!aside->empty())
    if (Status ok = forget_end(file.parent_path()); !ok) return pass(ok.error());
  CampaignHeader header = make_header(checked, rig);
  // The header holds both the rig file and the choice that shaped it, even if the campaign dies
  // before its first trial.
  if (settled.simulation.has_request()) header.simulation_json = to_json(settled.simulation);
  Result<Recorder> recorder = Recorder::create(file, header);
  if (!recorder) return recorder;
  if (session.real_time()) recorder->write_behind();
  if (Status ok = record_clock(*recorder, session.loop()); !ok) return pass(ok.error());
  if (!aside->empty())
    if (Status ok = recorder->journal(session.loop().now(), "set_aside",
                                      nlohmann::json{{"file", aside->string()}}.dump());
        !ok)
      return pass(ok.error());
  if (Status ok = record_devices(*recorder, session.bench(), *rig.drivers); !ok)
    return pass(ok.error());
  if (Status ok = recorder->journal(session.loop().now(), recipes::rules_kind,
                                    nlohmann::json{{"rules", recipes::engine_rules}}.dump());
      !ok)
    return pass(ok.error());
  if (checked.only_fabric)
    if (Status ok = recorder->journal(session.loop().now(), part_kind,
                                      nlohmann::json{{"fabric", *checked.only_fabric}}.dump());
        !ok)
      return pass(ok.error());
  if (const auto models = live_models_json(checked.plan, checked.models); models != "[]")
    if (Status ok = recorder->journal(session.loop().now(), live_models_kind, models); !ok)
      return pass(ok.error());
  return recorder;
}

Result<Recorder> reopened(const std::filesystem::path& file, const ResumePlan& how,
                          BenchSession& session) {
  if (Status same = same_devices(how.history.info.devices, session.bench()); !same)
    return pass(same.error());
  Result<Recorder> recorder = Recorder::resume(
      file, how.history, {how.first_trial, how.is_replayed, [folder = file.parent_path()] {
                            return forget_end(folder);
                          }});
  if (!recorder || recorder->is_replayed()) return recorder;
  if (session.real_time()) recorder->write_behind();
  if (Status ok = recorder->resume_recording(session.loop().now()); !ok) return pass(ok.error());
  if (Status ok = record_clock(*recorder, session.loop()); !ok) return pass(ok.error());
  return recorder;
}

Status conclude(const std::filesystem::path& folder, CampaignSummary& summary) {
  const auto began = steady_wall_now();
  Status ok;
  if (summary.trials_complete > summary.trials_ended_early) {
    summary.dataset_file = folder / dataset_file_name;
    auto digest = export_certified(summary.campaign_file, summary.dataset_file);
    if (!digest) return pass(digest.error());
    summary.dataset_sha256 = std::move(*digest);
  } else {
    ok = write_certificate(summary.campaign_file, {});
  }
  summary.time.export_s = std::chrono::duration<double>(steady_wall_now() - began).count();
  return ok;
}

void without_dataset(const std::filesystem::path& folder, const Error& why,
                     CampaignSummary& summary) {
  summary.dataset_error = why;
  summary.dataset_sha256 = certified_dataset(folder);  // of an earlier end, which is unchanged
  summary.dataset_file.clear();
  if (!summary.dataset_sha256.empty()) summary.dataset_file = folder / dataset_file_name;
  if (const auto found = load_progress(summary.campaign_file))
    summary.trials_complete = found->done;
  fail_where_trials_lack(summary);
}

void fail_where_trials_lack(CampaignSummary& summary) {
  if (summary.outcome == recipes::Outcome::complete &&
      summary.trials_complete < summary.trials_planned)
    summary.outcome = recipes::Outcome::failed;
}

CampaignSummary summary_on_record(const std::filesystem::path& folder,
                                  const CampaignHistory& history) {
  CampaignSummary summary;
  summary.cleanup = recipes::Cleanup::skipped;
  summary.rig = recipes::RigFact::unknown;
  summary.name = history.info.name;
  summary.bench = history.info.kind;
  summary.trials_planned = history.progress.planned;
  summary.trials_complete = history.complete();
  summary.attempts_rejected = history.rejected();
  summary.trials_ended_early = history.ended_early();
  summary.campaign_file = folder / campaign_file_name;
  return summary;
}

SimulationNote simulation_on_record(const std::filesystem::path& campaign) {
  SimulationNote out;
  const auto journal = load_journal(campaign);
  if (!journal) return out;
  for (const JournalEntry& entry : *journal)
    if (entry.kind == "simulation")
      if (auto note = simulation_note_from(entry.payload_json)) out = std::move(*note);
  return out;
}

namespace {

/// Summary of a campaign with every trial on record.
CampaignSummary make_summary(const std::filesystem::path& folder, const recipes::Plan& plan,
                             const RigFile& rig, const CampaignHistory& history) {
  CampaignSummary summary = summary_on_record(folder, history);
  summary.level = rig.plant_level;
  summary.simulation = simulation_on_record(summary.campaign_file);
  fail_where_trials_lack(summary);
  summary.forecast_s = plan.forecast.duration_s;
  summary.has_handover = plan.handover.has_value();
  summary.states_handover = plan.handover && !plan.handover->by_default;
  return summary;
}

/// Folds the write-ahead log in: the process may have died before it did so.
Status folded_in(const std::filesystem::path& campaign) {
  auto file = CampaignWriter::reopen(campaign);
  if (!file) return pass(file.error());
  return (*file)->finish();
}

}  // namespace

CampaignSummary concluded(const std::filesystem::path& folder, const recipes::Plan& plan,
                          const RigFile& rig, const CampaignHistory& history) {
  CampaignSummary summary = make_summary(folder, plan, rig, history);
  Status saved = folded_in(summary.campaign_file);
  if (saved) saved = conclude(folder, summary);
  if (!saved) without_dataset(folder, saved.error(), summary);
  return summary;
}

Result<CampaignSummary> certified_summary(const std::filesystem::path& folder,
                                          const recipes::Plan& plan, const RigFile& rig,
                                          const CampaignHistory& history) {
  CampaignSummary summary = make_summary(folder, plan, rig, history);
  const auto certificate = read_certificate(folder);
  if (!certificate) return pass(certificate.error());
  if (*certificate) summary.dataset_sha256 = (*certificate)->dataset_sha256;
  if (!summary.dataset_sha256.empty()) summary.dataset_file = folder / dataset_file_name;
  if (summary.trials_complete < summary.trials_planned)
    summary.error =
        Error{.code = Errc::trials_failed,
              .where = summary.campaign_file.string(),
              .what = "campaign has failed trials",
              .expected = std::to_string(summary.trials_planned),
              .got = std::to_string(summary.trials_complete),
              .hint = "See `weft log` or the journal in the file for the trials and reasons"};
  return summary;
}

}  // namespace weft::daemon
