#pragma once
// What `weft run` does with a complete campaign whose recipe has a hand_over.

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "daemon/apps/weft/console.hpp"
#include "daemon/campaign/campaign.hpp"
#include "daemon/storage/certificate/hand_over_file.hpp"

namespace weft::daemon::cli {

/// One of the two.
struct RunHandOver {
  std::optional<HandedOver> done;
  std::optional<Error> failed;        ///< the campaign and its data are what they are all the same
  std::filesystem::path folder = {};  ///< of what was done
};

/// Nothing where the campaign is not complete or its recipe wants none. Progress goes to the
/// console's `err`; SIGINT and SIGTERM end it.
std::optional<RunHandOver> hand_over_of(const CampaignSummary& summary,
                                        const std::filesystem::path& folder, Console& console);

std::string text_of(const RunHandOver& hand_over);
nlohmann::json json_of(const RunHandOver& hand_over);

}  // namespace weft::daemon::cli
