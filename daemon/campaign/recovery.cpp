// Discards an interrupted campaign, or keeps its complete trials; declared in resume.hpp.

#include "daemon/campaign/resume.hpp"

#include <nlohmann/json.hpp>

#include "daemon/campaign/campaign_file.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/recorder/campaign_folder.hpp"
#include "daemon/storage/recorder/campaign_writer.hpp"
#include "daemon/storage/recorder/log_check.hpp"

namespace weft::daemon {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

fs::path campaign_in(const fs::path& folder) {
  return folder / campaign_file_name;
}

bool has_campaign(const fs::path& folder) {
  std::error_code none;
  return fs::exists(campaign_in(folder), none) && !is_blank_campaign(campaign_in(folder));
}

std::string counted(std::size_t trials) {
  return std::to_string(trials) + (trials == 1 ? " trial" : " trials");
}

/// The campaign, if it has a complete trial to keep.
Result<CampaignHistory> load_partial_history(const fs::path& folder,
                                             const StopRequested& stop_requested) {
  if (!has_campaign(folder))
    return fail({.code = Errc::not_found,
                 .where = folder.string(),
                 .what = "no recorded campaign",
                 .hint = "Discard or resume the run"});
  if (Status ok = holds(campaign_in(folder), stop_requested); !ok) return pass(ok.error());
  auto history = load_history(campaign_in(folder));
  if (!history) return history;
  if (history->progress.discarded)
    return fail(
        {.code = Errc::wrong_state, .where = folder.string(), .what = "campaign discarded"});
  if (history->complete() > history->ended_early()) return history;
  return fail({.code = Errc::wrong_state,
               .where = folder.string(),
               .what = "campaign has no complete trial to keep",
               .hint = "Discard or resume the run"});
}

/// Ends a campaign file that is not resumed, with a last journal entry.
Status end_with(const fs::path& folder, std::string_view kind, const json& payload) {
  const fs::path campaign = campaign_in(folder);
  const auto journal = load_journal(campaign);
  if (!journal) return pass(journal.error());
  const TimePoint last = journal->empty() ? TimePoint{} : journal->back().time;
  if (Status ok = forget_end(folder); !ok) return ok;
  auto file = CampaignWriter::reopen(campaign);
  if (!file) return pass(file.error());
  if (Status ok = (*file)->left_behind(last, kind, payload.dump()); !ok) return ok;
  return (*file)->finish();
}

}  // namespace

Result<ResumePreview> preview_discard(const fs::path& folder) {
  ResumePreview out;
  if (!has_campaign(folder)) {
    out.will.push_back("end the run as aborted: nothing is recorded");
    return out;
  }
  const auto history = load_history(campaign_in(folder));
  if (history) {
    out.planned = history->progress.planned;
    out.complete = history->complete();
    out.left = out.planned - out.complete;
    out.will.push_back("mark the campaign file as discarded: its " + counted(out.complete) +
                       " stay in it without a data set");
    out.will.push_back("write its certificate");
  } else {
    out.will.push_back("leave the campaign file unchanged: " + to_string(history.error()));
  }
  out.will.push_back("end the run as aborted");
  out.will.push_back("leave the rig unchanged: nothing moves");
  return out;
}

Status discard_campaign(const fs::path& folder, std::string_view by) {
  if (!has_campaign(folder)) return {};
  const auto lock = FolderLock::take(folder);
  if (!lock) return pass(lock.error());
  if (Status ok = end_with(folder, discarded_kind, {{"by", by}}); !ok) return ok;
  return write_certificate(campaign_in(folder), {});
}

Result<ResumePreview> preview_keep_partial(const fs::path& folder,
                                           const StopRequested& stop_requested) {
  const auto history = load_partial_history(folder, stop_requested);
  if (!history) return pass(history.error());
  ResumePreview out;
  out.planned = history->progress.planned;
  out.complete = history->complete();
  out.left = out.planned - out.complete;
  out.will.push_back("end the campaign here: " + std::to_string(out.complete) + " of " +
                     counted(out.planned) + " complete");
  out.will.push_back("write the data set of the complete trials and the certificate");
  out.will.push_back("end the run as interrupted, with a partial data set");
  out.will.push_back("leave the rig unchanged: nothing moves");
  return out;
}

Result<CampaignSummary> keep_partial(const fs::path& folder, std::string_view by,
                                     const StopRequested& stop_requested) {
  const auto history = load_partial_history(folder, stop_requested);
  if (!history) return pass(history.error());
  const auto lock = FolderLock::take(folder);
  if (!lock) return pass(lock.error());
  CampaignSummary out = summary_on_record(folder, *history);
  out.outcome = recipes::Outcome::interrupted;
  const json payload{
      {"by", by}, {"complete", out.trials_complete}, {"planned", out.trials_planned}};
  if (Status ok = end_with(folder, kept_partial_kind, payload); !ok) return pass(ok.error());
  if (Status ok = conclude(folder, out); !ok) return pass(ok.error());
  return out;
}

}  // namespace weft::daemon
