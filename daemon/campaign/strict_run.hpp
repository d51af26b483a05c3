#pragma once
// `--accuracy-strict`: a campaign that missed its accuracy is run again with the next setting.

#include "daemon/campaign/campaign.hpp"

namespace weft::daemon {

/// Maximum number of repeated runs.
inline constexpr int most_strict_repeats = 3;

/// run_campaign(), repeated with the next setting if a strict request missed its accuracy. The
/// campaign must be complete and its resolved error above the requested accuracy; an unchecked or
/// unresolved error does not count. The files of such a run move to OUT/aside-N, with the
/// certificate that records the miss. At most most_strict_repeats runs follow. The last run stays
/// in OUT, whether it kept the accuracy or not. Its summary names the folders, and so does the
/// error of a run without a summary. A resumed campaign keeps its setting and is never repeated.
/// Errors: run_campaign()'s; io if files cannot be moved.
Result<CampaignSummary> run_until_held(const CampaignRequest& request, const CampaignHooks& hooks);

}  // namespace weft::daemon
