#include "daemon/campaign/strict_run.hpp"

#include "daemon/base/file/atomic_file.hpp"
#include "daemon/campaign/promise_text.hpp"
#include "daemon/storage/certificate/certificate.hpp"
#include "daemon/storage/recorder/campaign_folder.hpp"

namespace weft::daemon {
namespace {

namespace fs = std::filesystem;

/// Creates a new folder OUT/aside-N.
Result<fs::path> make_aside(const fs::path& out) {
  std::error_code error;
  for (int number = 1;; ++number) {
    fs::path aside = out / ("aside-" + std::to_string(number));
    if (fs::create_directory(aside, error)) return aside;
    if (!error) continue;  // it exists already
    return fail({.code = Errc::io,
                 .where = aside.string(),
                 .what = "folder for the campaign with missed accuracy not created",
                 .got = error.message()});
  }
}

/// Moves certificate and data set first: if this process dies in between, a resume concludes the
/// campaign again. Then the database, then its log, which is folded in. A log without its database
/// is useless, but a database without its log might lack its last trials.
Result<fs::path> move_aside(const fs::path& out) {
  const auto aside = make_aside(out);
  if (!aside) return aside;
  const std::string campaign(campaign_file_name);
  for (const std::string& name :
       {std::string(certificate_file_name), std::string(dataset_file_name), campaign,
        campaign + "-wal", campaign + "-shm"}) {
    std::error_code error;
    if (!fs::exists(out / name, error)) continue;
    fs::rename(out / name, *aside / name, error);
    if (error)
      return fail({.code = Errc::io,
                   .where = (out / name).string(),
                   .what = "campaign with missed accuracy not moved",
                   .got = error.message()});
  }
  Status ok = sync_folder(*aside);
  if (ok) ok = sync_folder(out);
  if (!ok) return pass(ok.error());
  return aside;
}

bool is_run_again(const CampaignRequest& request, const CampaignHooks& hooks,
                  const CampaignSummary& summary) {
  const bool stopped = (hooks.stop != nullptr && hooks.stop->load(std::memory_order_relaxed)) ||
                       (hooks.orders != nullptr && hooks.orders->ends_run());
  return request.fidelity.strict && !request.resume && !stopped && !summary.dataset_error &&
         summary.outcome == recipes::Outcome::complete && summary.simulation.promise &&
         is_measured_miss(*summary.simulation.promise) &&
         !summary.simulation.promise->next_setting.empty();
}

/// Adds the folders of earlier attempts to the error: no summary names them.
Error naming(Error error, std::vector<std::string> aside) {
  if (aside.empty()) return error;
  SimulationNote note;
  note.aside = std::move(aside);
  error.hint += (error.hint.empty() ? "" : "; ") + format_aside(note);
  return error;
}

}  // namespace

Result<CampaignSummary> run_until_held(const CampaignRequest& request, const CampaignHooks& hooks) {
  CampaignRequest attempt = request;
  CampaignHooks attempt_hooks = hooks;
  std::vector<std::string> aside;
  Result<CampaignSummary> summary = run_campaign(attempt, attempt_hooks);
  for (int repeat = 0; repeat < most_strict_repeats; ++repeat) {
    if (!summary || !is_run_again(attempt, hooks, *summary)) break;
    if (hooks.device_log)
      hooks.device_log({{}, LogLevel::warning, "simulation", format_promise(summary->simulation)});
    const auto moved = move_aside(request.out);
    if (!moved) return pass(naming(moved.error(), std::move(aside)));
    aside.push_back(moved->string());
    attempt.fidelity.promise_below_n = summary->simulation.promise->promised_n;
    attempt_hooks.rig_acquired = nullptr;  // the run already has the rig
    attempt_hooks.planned = nullptr;
    summary = run_campaign(attempt, attempt_hooks);
  }
  if (!summary) return pass(naming(summary.error(), std::move(aside)));
  summary->simulation.aside = std::move(aside);
  return summary;
}

}  // namespace weft::daemon
