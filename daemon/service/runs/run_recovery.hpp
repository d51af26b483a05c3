#pragma once
// Runs that can be recovered: previews of what a choice would do, the choices that end a run, and
// what others did in the folders of runs that are over. A disk may hang, so that none of it is done
// on the server's thread.

#include <filesystem>
#include <functional>
#include <map>
#include <thread>
#include <vector>

#include "daemon/campaign/resume.hpp"
#include "daemon/service/runs/run_context.hpp"

namespace weft::daemon::runs {

/// What becomes of a run that was interrupted or has ended with trials left.
enum class Recovery : std::uint8_t {
  resume,       ///< it is resumed where it was
  discard,      ///< it has ended, and no data set is made of it
  keep_partial  ///< it has ended, and its data set is of the trials that are complete
};
std::string_view to_string(Recovery choice);

/// Where a resumed run has its campaign: one that recorded something would begin anew, somewhere
/// else. Errors: not_found.
Status is_where_it_was(const StoredRun& run);
/// Whether a person may resume, discard or keep it: it was interrupted, or ended with trials left
/// and was not discarded.
bool is_recoverable(const RunView& run);

/// What is known of the folder of a run that is over.
struct FolderScan {
  StoredRun run;  ///< as it was when the scan began
  /// Of its certificate, as it was read last; the earliest time without a certificate.
  std::optional<std::filesystem::file_time_type> certified_at;
  std::optional<ExternalResume> found = {};
};

using PreviewCallback = std::function<void(const Result<ResumePreview>&)>;

/// Callbacks are called on the server's thread. Runs by their numbers.
class RunRecovery {
 public:
  explicit RunRecovery(const RunContext& context) : context_(context) {}  ///< outlives it
  RunRecovery(const RunRecovery&) = delete;
  RunRecovery& operator=(const RunRecovery&) = delete;
  ~RunRecovery();

  /// Reads and verifies the campaign. Those who ask for the same while it is read get that answer.
  void preview(const StoredRun& run, Recovery choice, Result<CampaignRequest> request,
               PreviewCallback on_preview);
  using SettleCallback = std::function<void(const Result<CampaignSummary>&)>;
  /// Discards the campaign or keeps its complete trials.
  void settle(const StoredRun& run, Recovery choice, std::string_view by, SettleCallback on_done);
  [[nodiscard]] bool is_settling(std::int64_t run) const;
  [[nodiscard]] bool is_settling() const;  ///< any
  /// What has only read so far ends.
  void stop_settling();
  /// Whether a scan is not under way, and the last one was more than a second ago.
  [[nodiscard]] bool can_scan() const;
  /// Looks at the folders, and calls back for each whose certificate is another one.
  void scan(std::vector<FolderScan> scans, std::function<void(const FolderScan&)> on_news);

 private:
  struct PreviewRequest {
    Recovery choice;
    Result<CampaignRequest> request;
    PreviewCallback on_preview;
  };
  struct Activity {
    std::vector<PreviewRequest> previews;  ///< wait for what `preview_thread` finds
    std::jthread preview_thread;
    bool is_settling = false;
    std::jthread settle_thread;
  };
  void read_preview(Activity& activity);
  /// Does `work` on `thread`, then `on_done` with its result on the server's.
  template <class Work, class OnDone>
  void start(std::jthread& thread, Work work, OnDone on_done);

  const RunContext& context_;
  std::map<std::int64_t, Activity> activities_;
  std::chrono::nanoseconds next_scan_{};
  std::jthread scan_thread_;
};

}  // namespace weft::daemon::runs
