#pragma once
// What becomes of a campaign whose process died, where nobody goes on with it: discarded, or kept
// as far as it came. Nothing moves, and nothing that was recorded is removed.

#include <filesystem>
#include <string_view>

#include "daemon/campaign/campaign.hpp"
#include "daemon/campaign/resume.hpp"

namespace weft::daemon {

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
