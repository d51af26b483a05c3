#pragma once
// Runs an alignment on a bench, from a rig file to what was found.

#include <atomic>
#include <filesystem>
#include <functional>
#include <optional>

#include "daemon/campaign/bench_session.hpp"
#include "daemon/campaign/machine_run.hpp"
#include "daemon/campaign/trial_recording.hpp"
#include "recipes/alignment/alignment.hpp"

namespace weft::daemon {

using AlignRun = MachineRun<recipes::AlignPlan, recipes::AlignState, recipes::AlignDone>;

struct AlignRequest {
  std::filesystem::path rig;
  recipes::AlignSettings settings;
  std::uint64_t seed = 1;  ///< of a simulated bench's sensors
  PluginSettings plugins = {};
  std::function<void(const DeviceLogEntry&)> device_log = {};
  std::function<void(const recipes::AlignState&)> moved_on = {};  ///< after each step
  const std::atomic<bool>* stop = nullptr;                        ///< set: abort, the probe up
};

struct AlignSummary {
  std::string rig_name;
  BenchKind bench = BenchKind::unknown;  ///< of what was touched
  recipes::AlignPlan plan;
  recipes::AlignDone done;
  std::vector<recipes::TiltFound> rounds;  ///< the first is the tilt before, the last after
  double bench_s = 0;                      ///< of the bench's own time
  std::int64_t measured_unix_s = 0;        ///< when it ended
};

/// Brings the bench up, aligns, and leaves the rotary stages where they are and the probe up. An
/// alignment that did not succeed is a summary with its error; errors are what kept it from
/// beginning.
Result<AlignSummary> run_alignment(const AlignRequest& request);

}  // namespace weft::daemon
