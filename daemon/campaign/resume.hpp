#pragma once
// A campaign whose process died or was stopped. Resumed: what is left, and whether the recipe, the
// rig and the devices are those of its file. Not resumed: discarded, or kept as far as it came.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/base/file/read_file.hpp"
#include "daemon/campaign/campaign.hpp"
#include "daemon/hardware/rig/bench.hpp"
#include "daemon/storage/recorder/campaign_history.hpp"

namespace weft::daemon {

/// What going on means for one file.
struct ResumePlan {
  CampaignHistory history;
  std::uint32_t first_trial = 0;  ///< of the plan; its size when none is left
  std::uint32_t rejected = 0;     ///< takes of it that were bad: kill or not, they count
  /// A simulated bench died with its process: it is made again by playing the trials of the past,
  /// each compared with what is on record, so that the rest comes out as if nothing had happened.
  bool is_replayed = false;
  /// Every trial is recorded; the file's end, data set and certificate are missing, or some of
  /// them. Nothing moves.
  bool only_concludes = false;
  /// It came to its end, all of it complete, and its recipe's hand-over is not there. Nothing
  /// moves, nothing is written: who runs campaigns hands them over.
  bool only_runs_handover = false;
  /// It came to its end, certified, and nothing is left to do, though trials of it may have failed.
  /// Nothing moves, nothing is written.
  bool only_reports = false;
};

/// Nothing when the folder holds no campaign, or one of which nothing was written yet: it begins
/// then like any other. Errors: corrupt, when the file does not hold; wrong_state with what
/// differs, when recipe, rig or seed are not the file's; wrong_state, when nothing is left to do
/// and not `accept_whole`, or it was discarded.
Result<std::optional<ResumePlan>> resume_plan(const std::filesystem::path& campaign,
                                              const CheckedRequest& checked, BenchMode mode,
                                              bool accept_whole = false,
                                              const StopRequested& stop_requested = {});

/// Refuses a folder with what a campaign leaves at its end, and no campaign: one that began there
/// would take the place of that data set, and be judged by that certificate. Errors: corrupt.
Status require_no_existing_dataset(const std::filesystem::path& folder);

/// The campaign's folder is what was recorded. Errors: verify()'s; corrupt, with the first finding.
Status holds(const std::filesystem::path& campaign, const StopRequested& stop_requested);

/// Whether the folder's campaign may be gone on with by what its file says, which is not verified.
/// True as well where that cannot be read: somebody may put right what keeps it from it.
bool is_anything_left(const CampaignRequest& request);

/// The digest of the data set of which it tells; empty where there is neither.
std::string certified_dataset(const std::filesystem::path& folder);

/// A hand-over that was begun is there whole, or there is none: this asks no more than which.
bool is_handover_done(const std::filesystem::path& folder);

/// By the folder's file alone, whatever recipe and rig file are now: every trial is on record, the
/// last of them may have failed; data set and certificate are missing. Errors: load_history()'s.
Result<bool> is_only_end_left(const std::filesystem::path& folder);

/// The bench that came up is the one on record. Errors: wrong_state, naming the device.
Status same_devices(const std::vector<DeviceInfo>& recorded, const Bench& bench);

/// What a resume would do, in order, in words; nothing moves.
struct ResumePreview {
  std::size_t planned = 0, complete = 0, left = 0;  ///< trials
  std::vector<std::string> will;
};
/// Errors: check_request()'s and resume_plan()'s.
Result<ResumePreview> preview_resume(const CampaignRequest& request,
                                     const StopRequested& stop_requested = {});

// What becomes of a campaign whose process died, where nobody goes on with it: discarded, or kept
// as far as it came. Nothing moves, and nothing that was recorded is removed.

/// What discard_campaign() would do, in words. Errors: io of the folder.
Result<ResumePreview> preview_discard(const std::filesystem::path& folder);

/// Marks the campaign file of a folder as discarded: its trials stay, and no data set is made of
/// them any more. Its certificate is made anew, a data set that is there set aside. A folder
/// without a campaign is left as it is. `by`: who says so, for the file's journal.
/// Errors: wrong_state, when a run works in the folder; those of the file.
Status discard_campaign(const std::filesystem::path& folder, std::string_view by);

/// What keep_partial() would do. Errors: not_found, when nothing is on record; wrong_state, when no
/// trial is complete; corrupt, when the file does not hold.
Result<ResumePreview> preview_keep_partial(const std::filesystem::path& folder,
                                           const StopRequested& stop_requested = {});

/// Ends the campaign of a folder where it is: a data set of its complete trials and a certificate
/// that says how many were planned. Errors: as preview_keep_partial(), and discard_campaign()'s.
Result<CampaignSummary> keep_partial(const std::filesystem::path& folder, std::string_view by,
                                     const StopRequested& stop_requested = {});

}  // namespace weft::daemon
