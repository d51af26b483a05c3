#pragma once
// A simulated bench whose table promises what a test says. SIMULATED.

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "recipes/engine/engine.hpp"
#include "sim/plant/fidelity/table.hpp"
#include "tests/unit/daemon/benches/trial_bench.hpp"

namespace weft::daemon::test {

/// Without settings: of this version's rules and the shipped cloths, with ranges of usual recipes
/// and margins that hold.
sim::FidelityTable empty_table();
/// bench17 with a table of three settings, which is for tests alone. `scale`: of its errors.
nlohmann::json rig_with_table(const TemporaryFolder& folder, double scale = 1,
                              int rules = recipes::engine_rules,
                              const std::string& fabrics_sha256 = {});
/// short_recipe() of denim on it, on a machine as fast as the table's.
CampaignRequest denim_request(const TemporaryFolder& folder, double scale = 1);

}  // namespace weft::daemon::test
