// What becomes of the campaign of a run that is over, where somebody goes on with it without the
// daemon.

#include "daemon/base/loop/caught.hpp"
#include "daemon/service/runs/desk_run.hpp"
#include "daemon/storage/certificate/certificate.hpp"

namespace weft::daemon::control {
namespace {

using Since = std::optional<CampaignSince>;

/// Nothing where the folder's end is still the run's, or there is none. A certificate comes last.
Result<Since> since_in(const std::filesystem::path& folder, const std::string& dataset_sha256) {
  CampaignSince out;
  out.dataset_sha256 = certified_dataset(folder);
  if (out.dataset_sha256.empty() || out.dataset_sha256 == dataset_sha256) return Since{};
  const auto now = load_progress(folder / campaign_file_name);
  if (!now) return pass(now.error());
  out.trials_done = now->done;
  out.trials_planned = now->planned;
  out.complete = now->finished && now->done == now->planned;
  return Since(std::move(out));
}

}  // namespace

bool RunDesk::may_be_gone_on_with(const Run& run) {
  const StoredRun& stored = run.view.stored;
  return run.is_over() && !run.at_work && !run.settling && !stored.has_all() &&
         stored.recovered != to_string(Recovery::discard);
}

/// A disk may hang, so that no folder is looked at by the thread of the server.
void RunDesk::look_at_folders() {
  constexpr std::chrono::seconds between{1};
  if (folder_reader_.joinable() || around_.now() < next_look_) return;
  next_look_ = around_.now() + between;
  std::vector<Look> looks;
  for (const auto& run : runs_)
    if (may_be_gone_on_with(*run))
      looks.push_back(
          {run.get(), run->view.stored.folder, run->view.stored.dataset_sha256, run->certified_at});
  if (looks.empty()) return;
  folder_reader_ = std::jthread([this, looks = std::move(looks)]() mutable {
    std::erase_if(looks, [](Look& look) { return !has_news(look); });
    around_.post([this, looks = std::move(looks)] {
      folder_reader_.join();  // this was its last word
      for (const Look& look : looks) seen(look);
    });
  });
}

/// What cannot be read is looked at again.
bool RunDesk::has_news(Look& look) {
  std::error_code unseen;
  const auto written = std::filesystem::last_write_time(look.folder / certificate_file_name,
                                                        unseen);  // the earliest without one
  if (look.certified_at == written) return false;
  const auto read = caught([&] { return since_in(look.folder, look.dataset_sha256); });
  if (!read) return false;
  look.certified_at = written;
  look.since = *read;
  return true;
}

void RunDesk::seen(const Look& look) {
  Run& run = *look.run;
  if (!may_be_gone_on_with(run) || look.dataset_sha256 != run.view.stored.dataset_sha256) return;
  run.certified_at = look.certified_at;
  if (look.since == run.view.since) return;
  run.view.since = look.since;
  tell(run, "auto:folder");
}

}  // namespace weft::daemon::control
