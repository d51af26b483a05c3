#pragma once
// `weft run --part` and `weft dataset merge`.

#include "daemon/apps/weft/console.hpp"
#include "daemon/campaign/parts.hpp"

namespace weft::daemon::cli {

/// Runs one part with progress and stop signals. `yes`: operator steps count as done. Returns
/// exit_failure if a campaign is incomplete; exit_signal + number after a signal.
Result<int> run_part_here(const CampaignRequest& request, const PartNumber& part, bool yes,
                          Console& console);

}  // namespace weft::daemon::cli
