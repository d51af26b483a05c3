#pragma once
// Text and JSON of the laboratory's store, for `weft lab`. Simulated benches are marked everywhere.

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "daemon/service/lab/lab_store.hpp"

namespace weft::daemon::cli {

std::string format_rigs(const std::vector<lab::RigEntry>& rigs);
nlohmann::json to_json(const lab::RigEntry& rig);

std::string format_runs(const std::vector<lab::RunEntry>& runs);
nlohmann::json to_json(const lab::RunEntry& run);

/// `benches`: kind of each rig by its name.
std::string format_campaign(const lab::LabCampaign& campaign,
                            const std::map<std::string, BenchKind>& benches);
nlohmann::json to_json(const lab::LabCampaign& campaign,
                       const std::map<std::string, BenchKind>& benches);

}  // namespace weft::daemon::cli
