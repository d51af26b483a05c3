// What becomes of the campaign of a run that is over, where somebody goes on with it without the
// daemon.

#include "daemon/certificate/certificate.hpp"
#include "daemon/control/caught.hpp"
#include "daemon/control/desk_run.hpp"

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

void RunDesk::look_at_next_folder() {
  if (runs_.empty() || folder_reader_.joinable()) return;
  Run& run = *runs_[folders_looked_at_++ % runs_.size()];
  const StoredRun& stored = run.view.stored;
  if (!run.is_over() || run.at_work || run.settling || stored.has_all()) return;
  std::error_code unseen;
  const auto written = std::filesystem::last_write_time(stored.folder / certificate_file_name,
                                                        unseen);  // the earliest without one
  if (run.certified_at == written) return;
  run.certified_at = written;
  folder_reader_ =
      std::jthread([this, &run, folder = stored.folder, sha256 = stored.dataset_sha256] {
        const auto read = caught([&] { return since_in(folder, sha256); });
        around_.post([this, &run, read, sha256] {
          folder_reader_.join();  // this was its last word
          const Since now = read.value_or(Since{});
          if (sha256 != run.view.stored.dataset_sha256 || now == run.view.since) return;
          run.view.since = now;
          tell(run, "auto:folder");
        });
      });
}

}  // namespace weft::daemon::control
