#pragma once
// `--accuracy-strict`: a campaign that missed its accuracy is run again with the next setting.

#include "daemon/campaign/campaign.hpp"

namespace weft::daemon {

/// How often a campaign is run again.
inline constexpr int most_strict_repeats = 3;

/// run_campaign(); where the request is strict and a complete campaign's error is above the
/// accuracy asked for (what was not checked, or is not resolved, says nothing against the setting),
/// its files move to OUT/aside-N, with the certificate that says so, and the next setting of the
/// table runs, at most most_strict_repeats times. The last run stays in OUT whether it kept the
/// accuracy or not; its summary names the folders, as does the error of a run that has none. A
/// resumed campaign keeps its setting: it is never run again. Errors: run_campaign()'s; io, when
/// files cannot be moved.
Result<CampaignSummary> run_until_held(const CampaignRequest& request, const CampaignHooks& hooks);

}  // namespace weft::daemon
