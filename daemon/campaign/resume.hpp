#pragma once
// Recovery of a campaign after its process died or was stopped. Resume: finds the remaining trials
// and checks that recipe, rig and devices match its file. Otherwise: discard it, or keep its
// complete trials.

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

/// How to resume one campaign file.
struct ResumePlan {
  CampaignHistory history;
  std::uint32_t first_trial = 0;  ///< of the plan; its size if none is left
  std::uint32_t rejected = 0;     ///< rejected attempts at it; they count even after a kill
  /// The simulated bench died with its process. It is rebuilt by a replay of the past trials, each
  /// compared with its record. The remaining trials are then the same as without the interruption.
  bool is_replayed = false;
  /// Every trial is recorded, but the end of the file, data set or certificate is missing. Nothing
  /// moves.
  bool only_concludes = false;
  /// The campaign ended complete, but the handover that its recipe requests is missing. Nothing
  /// moves, nothing is written: the caller runs the handover.
  bool only_runs_handover = false;
  /// The campaign ended with its certificate and nothing is left to do, though trials may have
  /// failed. Nothing moves, nothing is written.
  bool only_reports = false;
};

/// Nothing if the folder holds no campaign, or one without a trial: it then starts like any other.
/// Errors: corrupt if the file is not as recorded; wrong_state with the differences if recipe, rig
/// or seed are not the file's. Also wrong_state if it was discarded, or if nothing is left to do
/// and not `accept_whole`.
Result<std::optional<ResumePlan>> resume_plan(const std::filesystem::path& campaign,
                                              const CheckedRequest& checked, BenchMode mode,
                                              bool accept_whole = false,
                                              const StopRequested& stop_requested = {});

/// Refuses a folder with data set or certificate but without a campaign. A campaign started there
/// would replace that data set and be checked against that certificate. Errors: corrupt.
Status require_no_existing_dataset(const std::filesystem::path& folder);

/// Checks that the campaign's folder is as recorded. Errors: verify()'s; corrupt, with the first
/// finding.
Status holds(const std::filesystem::path& campaign, const StopRequested& stop_requested);

/// Whether the folder's campaign can be resumed, by its file, which is not verified. Also true if
/// the file cannot be read: a person may repair the cause.
bool is_anything_left(const CampaignRequest& request);

/// The data set's digest in the certificate; empty without certificate or data set.
std::string certified_dataset(const std::filesystem::path& folder);

/// Whether a handover is present. A handover is stored whole or not at all, so only its folder is
/// checked.
bool is_handover_done(const std::filesystem::path& folder);

/// True if every trial is on record and data set or certificate is missing. The last trials may
/// have failed. Reads the folder's file only, whatever recipe and rig file are now. Errors:
/// load_history()'s.
Result<bool> is_only_end_left(const std::filesystem::path& folder);

/// Checks that the bench has the recorded devices. Errors: wrong_state, naming the device.
Status same_devices(const std::vector<DeviceInfo>& recorded, const Bench& bench);

/// The steps of a resume or recovery, in order, in words; nothing moves.
struct ResumePreview {
  std::size_t planned = 0, complete = 0, left = 0;  ///< trials
  std::vector<std::string> will;
};
/// Errors: check_request()'s and resume_plan()'s.
Result<ResumePreview> preview_resume(const CampaignRequest& request,
                                     const StopRequested& stop_requested = {});

// Recovery of a dead campaign without a resume: discard it, or keep its complete trials. Nothing
// moves, and no recorded data are removed.

/// The effects of discard_campaign(), in words. Does not fail on an unreadable file.
Result<ResumePreview> preview_discard(const std::filesystem::path& folder);

/// Marks the campaign file of a folder as discarded: its trials stay, but they go into no data set.
/// Writes a new certificate and sets an existing data set aside. Leaves a folder without a campaign
/// as it is. `by`: the user, for the file's journal. Errors: wrong_state if a run works in the
/// folder; those of the file.
Status discard_campaign(const std::filesystem::path& folder, std::string_view by);

/// The effects of keep_partial(), in words. Errors: not_found if nothing is on record; wrong_state
/// if no trial is complete or it was discarded; corrupt if the file is not as recorded.
Result<ResumePreview> preview_keep_partial(const std::filesystem::path& folder,
                                           const StopRequested& stop_requested = {});

/// Ends the campaign of a folder early: writes a data set of its complete trials and a certificate
/// with the planned number. Errors: as preview_keep_partial(), and discard_campaign()'s.
Result<CampaignSummary> keep_partial(const std::filesystem::path& folder, std::string_view by,
                                     const StopRequested& stop_requested = {});

}  // namespace weft::daemon
