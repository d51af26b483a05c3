#pragma once
// Trajectories of scenes as a file (JSON), so that a solver that is no part of Weft can be the
// reference: tests/bench/peers/sim_reference.cc makes one with SUNDIALS CVODE.

#include <map>
#include <span>
#include <string>
#include <string_view>

#include "daemon/analysis/tradeoff/sim/measure_sim.hpp"

namespace weft::daemon {

struct ReferenceScene {
  const SimScene& scene;
  const std::vector<SimTrace>& traces;  ///< one per case
};

std::string write_references(const std::string& made_by, std::span<const ReferenceScene> scenes);

/// By scene, for the scenes that `library` makes; scenes of the file that are not asked for are
/// skipped. Errors: parse, with where; invalid_argument for trajectories of other scenes than
/// these (another cloth table, another version of the scenes).
Result<std::map<std::string, SimReference>> read_references(std::string_view json,
                                                            std::span<const SimScene> scenes);

}  // namespace weft::daemon
