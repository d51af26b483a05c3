#pragma once
// A simulated bench ready to be driven: virtual time, emulated devices, links between them.

#include <filesystem>
#include <memory>

#include "daemon/base/loop/timed_loop.hpp"
#include "daemon/hardware/link/memory_link.hpp"
#include "daemon/hardware/rig/bench.hpp"
#include "recipes/engine/rig_limits.hpp"
#include "sim/rig/rig.hpp"

namespace weft::daemon {

/// Members are destroyed last to first: drivers before links, links before the rig, the loop last.
struct SimulatedBench {
  VirtualLoop loop;
  TimedLoop rig_time{loop};   ///< callbacks of emulators and plant
  TimedLoop host_time{loop};  ///< callbacks of drivers and supervisor
  std::unique_ptr<sim::Rig> rig;
  std::vector<std::unique_ptr<MemoryLink>> far_ends;
  std::unique_ptr<Bench> bench;

  /// `fabrics_json` is the text of the rig file's cloth table.
  static Result<std::unique_ptr<SimulatedBench>> create(const RigFile& rig_file,
                                                        std::string_view fabrics_json,
                                                        std::uint64_t seed);
};

/// Drivers and emulators are configured apart, as they are on a real bench. Refuses rates that
/// disagree before they become a wrong rate in the data set.
Status same_rates(const RigFile& rig, const recipes::RigLimits& limits, const sim::Rig& emulated);

/// Text of the cloth table that the rig file names (`simulation.fabrics`, relative to it).
Result<std::string> read_fabrics(const RigFile& rig_file, const std::filesystem::path& rig_path);

}  // namespace weft::daemon
