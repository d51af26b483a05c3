#include "daemon/service/runs/run_recovery.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "daemon/base/loop/threads.hpp"
#include "daemon/campaign/resume.hpp"
#include "daemon/storage/certificate/certificate.hpp"

namespace weft::daemon::runs {
namespace {

Result<ResumePreview> make_preview(Recovery choice, CampaignRequest request,
                                   const StopRequested& stop_requested) {
  request.resume = true;
  switch (choice) {
    case Recovery::resume:
      return preview_resume(request, stop_requested);
    case Recovery::discard:
      return preview_discard(request.out);
    case Recovery::keep_partial:
      return preview_keep_partial(request.out, stop_requested);
  }
  return fail({.code = Errc::invalid_argument, .what = "unknown recovery choice"});
}

/// A damaged file cannot be marked, but no data set can be made of it either. Any other error,
/// which may be repaired, prevents the discard.
Result<CampaignSummary> discarded(const std::filesystem::path& folder, std::string_view by) {
  CampaignSummary out;
  out.outcome = recipes::Outcome::aborted;
  const Status marked = discard_campaign(folder, by);
  if (marked) return out;
  const Errc code = marked.error().code;
  if (code != Errc::corrupt && code != Errc::parse) return pass(marked.error());
  out.error = Error(marked.error()).in("not marked as discarded");
  return out;
}

/// Empty if the folder still has the run's own end, or none. The certificate is written last.
Result<std::optional<ExternalResume>> read_external_resume(const StoredRun& run) {
  ExternalResume out;
  out.dataset_sha256 = certified_dataset(run.folder);
  if (out.dataset_sha256.empty() || out.dataset_sha256 == run.dataset_sha256)
    return std::optional<ExternalResume>();
  const auto now = load_progress(run.folder / campaign_file_name);
  if (!now) return pass(now.error());
  out.trials_done = now->done;
  out.trials_planned = now->planned;
  out.complete = now->finished && now->done == now->planned;
  return std::optional(std::move(out));
}

/// A folder that cannot be read is scanned again later.
bool has_news(FolderScan& scan) {
  std::error_code unseen;
  const auto written =
      std::filesystem::last_write_time(scan.run.folder / certificate_file_name, unseen);
  if (scan.certified_at == written) return false;
  const auto read = catch_as_error([&] { return read_external_resume(scan.run); });
  if (!read) return false;
  scan.certified_at = written;
  scan.found = *read;
  return true;
}

}  // namespace

std::string_view to_string(Recovery choice) {
  constexpr std::array<std::string_view, 3> names{"resume", "discard", "keep-partial"};
  return names[static_cast<std::size_t>(choice)];
}

Status is_where_it_was(const StoredRun& run) {
  std::error_code unseen;
  const std::filesystem::path campaign = run.folder / campaign_file_name;
  if (run.trials_done == 0 || std::filesystem::exists(campaign, unseen)) return {};
  return fail({.code = Errc::not_found,
               .where = campaign.string(),
               .what = "campaign file of this run missing",
               .hint = "Restore its folder, or discard the run"});
}

bool is_recoverable(const RunView& run) {
  if (run.state() == RunState::interrupted) return true;
  const StoredRun& stored = run.stored;
  const bool has_all = stored.has_all() || (run.external_resume && run.external_resume->complete);
  return run.state() == RunState::ended && !has_all && stored.outcome != "complete" &&
         stored.recovered != to_string(Recovery::discard);
}

RunRecovery::~RunRecovery() {
  for (auto& [run, activity] : activities_) activity.preview_thread.request_stop();
}

void RunRecovery::preview(const StoredRun& run, Recovery choice, Result<CampaignRequest> request,
                          PreviewCallback on_preview) {
  Activity& activity = activities_[run.number];
  activity.previews.push_back({choice, std::move(request), std::move(on_preview)});
  if (activity.previews.size() == 1) read_preview(activity);
}

template <class Work, class OnDone>
void RunRecovery::start(std::jthread& thread, Work work, OnDone on_done) {
  thread = std::jthread([this, &thread, work = std::move(work),
                         on_done = std::move(on_done)](const std::stop_token& stop) mutable {
    context_.post([&thread, on_done, result = work(stop)] {
      thread.join();  // this was its last message
      on_done(result);
    });
  });
}

void RunRecovery::read_preview(Activity& activity) {
  const Recovery choice = activity.previews.front().choice;
  start(
      activity.preview_thread,
      [choice, request = activity.previews.front().request](const std::stop_token& stop) {
        return catch_as_error([&]() -> Result<ResumePreview> {
          if (!request) return pass(request.error());
          return make_preview(choice, *request, [&stop] { return stop.stop_requested(); });
        });
      },
      [this, &activity, choice](const Result<ResumePreview>& left) {
        for (auto& each : std::exchange(activity.previews, {}))
          if (each.choice == choice)
            each.on_preview(left);
          else
            activity.previews.push_back(std::move(each));
        if (!activity.previews.empty()) read_preview(activity);
      });
}

void RunRecovery::settle(const StoredRun& run, Recovery choice, std::string_view by,
                         SettleCallback on_done) {
  Activity& activity = activities_[run.number];
  activity.is_settling = true;
  start(
      activity.settle_thread,
      [choice, by = std::string(by), folder = run.folder](const std::stop_token& stop) {
        return catch_as_error([&]() -> Result<CampaignSummary> {
          if (choice == Recovery::discard) return discarded(folder, by);
          return keep_partial(folder, by, [&stop] { return stop.stop_requested(); });
        });
      },
      [&activity, on_done = std::move(on_done)](const Result<CampaignSummary>& summary) {
        activity.is_settling = false;
        on_done(summary);
      });
}

bool RunRecovery::is_settling(std::int64_t run) const {
  const auto found = activities_.find(run);
  return found != activities_.end() && found->second.is_settling;
}

bool RunRecovery::is_settling() const {
  return std::ranges::any_of(activities_, [](const auto& one) { return one.second.is_settling; });
}

void RunRecovery::stop_settling() {
  for (auto& [run, activity] : activities_) activity.settle_thread.request_stop();
}

bool RunRecovery::can_scan() const {
  return !scan_thread_.joinable() && context_.now() >= next_scan_;
}

void RunRecovery::scan(std::vector<FolderScan> scans,
                       std::function<void(const FolderScan&)> on_news) {
  next_scan_ = context_.now() + std::chrono::seconds(1);
  std::erase_if(activities_, [](const auto& one) {
    const Activity& activity = one.second;
    return activity.previews.empty() && !activity.preview_thread.joinable() &&
           !activity.settle_thread.joinable();
  });
  if (scans.empty()) return;
  start(
      scan_thread_,
      [scans = std::move(scans)](const std::stop_token&) mutable {
        std::erase_if(scans, [](FolderScan& scan) { return !has_news(scan); });
        return std::exchange(scans, {});
      },
      [on_news = std::move(on_news)](const std::vector<FolderScan>& news) {
        std::ranges::for_each(news, on_news);
      });
}

}  // namespace weft::daemon::runs
