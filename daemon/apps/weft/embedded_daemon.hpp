#pragma once
// The daemon inside `weft run`: others look at its campaign, hold it and end it by a socket, as
// they do with weftd.

#include <functional>

#include "daemon/apps/weft/console.hpp"
#include "daemon/apps/weft/run_command.hpp"
#include "daemon/campaign/campaign.hpp"

namespace weft::daemon::cli {

using Campaign = std::function<Result<CampaignSummary>(const CampaignHooks& hooks)>;

/// Calls `campaign` once, on another thread, with what others ask for as orders in `hooks`, and
/// serves it on the socket until it has ended. Where no socket can be had that is said, and the
/// campaign runs all the same, on this thread. What it throws is an error.
Result<CampaignSummary> run_with_daemon(const RunArgs& args, const CampaignRequest& request,
                                        const Campaign& campaign, Console& console);

}  // namespace weft::daemon::cli
