#pragma once
// Recovery of runs: previews of a choice, the choices that end a run, and scans of ended runs'
// folders for changes by other programs. A disk may hang, so none of this runs on the server's
// thread.

#include <filesystem>
#include <functional>
#include <map>
#include <thread>
#include <vector>

#include "daemon/campaign/resume.hpp"
#include "daemon/service/runs/run_context.hpp"

namespace weft::daemon::runs {

/// Choices for a run that was interrupted or has ended with trials left.
enum class Recovery : std::uint8_t {
  resume,       ///< it continues with the next trial
  discard,      ///< it ends without a data set
  keep_partial  ///< it ends with a data set of the complete trials
};
std::string_view to_string(Recovery choice);

/// Checks that a resumed run still has its campaign file; without it a run with recorded trials
/// would start again elsewhere. Errors: not_found.
Status is_where_it_was(const StoredRun& run);
/// True if a person may resume, discard or keep it: it was interrupted, or ended with trials left
/// and was not discarded.
bool is_recoverable(const RunView& run);

/// Known facts about the folder of an ended run.
struct FolderScan {
  StoredRun run;  ///< as it was when the scan started
  /// Write time of its certificate when last read; the earliest time without one.
  std::optional<std::filesystem::file_time_type> certified_at;
  std::optional<ExternalResume> found = {};
};

using PreviewCallback = std::function<void(const Result<ResumePreview>&)>;

/// Callbacks are called on the server's thread. Runs are identified by their numbers.
class RunRecovery {
 public:
  explicit RunRecovery(const RunContext& context) : context_(context) {}  ///< must outlive it
  RunRecovery(const RunRecovery&) = delete;
  RunRecovery& operator=(const RunRecovery&) = delete;
  ~RunRecovery();

  /// Reads and verifies the campaign. Concurrent previews of a run share one reading.
  void preview(const StoredRun& run, Recovery choice, Result<CampaignRequest> request,
               PreviewCallback on_preview);
  using SettleCallback = std::function<void(const Result<CampaignSummary>&)>;
  /// Discards the campaign or keeps its complete trials.
  void settle(const StoredRun& run, Recovery choice, std::string_view by, SettleCallback on_done);
  [[nodiscard]] bool is_settling(std::int64_t run) const;
  [[nodiscard]] bool is_settling() const;  ///< any run
  /// Cancels recoveries that have only read so far.
  void stop_settling();
  /// True if no scan is active and the last one was more than a second ago.
  [[nodiscard]] bool can_scan() const;
  /// Scans the folders and calls back for each with a changed certificate.
  void scan(std::vector<FolderScan> scans, std::function<void(const FolderScan&)> on_news);

 private:
  struct PreviewRequest {
    Recovery choice;
    Result<CampaignRequest> request;
    PreviewCallback on_preview;
  };
  struct Activity {
    std::vector<PreviewRequest> previews;  ///< wait for the result of `preview_thread`
    std::jthread preview_thread;
    bool is_settling = false;
    std::jthread settle_thread;
  };
  void read_preview(Activity& activity);
  /// Runs `work` on `thread`, then `on_done` with its result on the server's thread.
  template <class Work, class OnDone>
  void start(std::jthread& thread, Work work, OnDone on_done);

  const RunContext& context_;
  std::map<std::int64_t, Activity> activities_;
  std::chrono::nanoseconds next_scan_{};
  std::jthread scan_thread_;
};

}  // namespace weft::daemon::runs
