#pragma once
// What `weft run` does with a complete campaign whose recipe has a hand_over.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "daemon/apps/weft/console.hpp"
#include "daemon/campaign/campaign.hpp"
#include "daemon/storage/certificate/handover_file.hpp"

namespace weft::daemon::cli {

/// One of the two.
struct RunHandover {
  std::optional<HandoverResult> done;
  std::optional<Error> failed;        ///< the campaign and its data are what they are all the same
  std::filesystem::path folder = {};  ///< of what was done
};

/// Nothing where the campaign is not complete or its recipe wants none. Progress goes to the
/// console's `err`; SIGINT and SIGTERM end it.
std::optional<RunHandover> handover_of_run(const CampaignSummary& summary,
                                           const std::filesystem::path& folder, Console& console);

std::string format_text(const RunHandover& handover);
nlohmann::json json_of(const RunHandover& handover);

}  // namespace weft::daemon::cli
