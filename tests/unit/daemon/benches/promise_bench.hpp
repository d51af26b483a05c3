#pragma once
// A simulated bench with a table of given promises. SIMULATED.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "recipes/engine/engine.hpp"
#include "sim/plant/fidelity/table.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace weft::daemon::test {

/// A table without settings: for this version's rules and the shipped fabrics, with the ranges of
/// usual recipes and valid margins.
sim::FidelityTable empty_table();
/// bench17 with a table of three settings, for tests only. `scale` multiplies its errors.
nlohmann::json rig_with_table(const TemporaryFolder& folder, double scale = 1,
                              int rules = recipes::engine_rules,
                              const std::string& fabrics_sha256 = {});
/// short_recipe() of denim on it, on a machine with the table's speed.
CampaignRequest denim_request(const TemporaryFolder& folder, double scale = 1);

}  // namespace weft::daemon::test
