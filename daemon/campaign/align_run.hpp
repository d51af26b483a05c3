#pragma once
// Runs an alignment on a bench: from a rig file to the measured plate tilt.

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
  std::uint64_t seed = 1;  ///< seeds the sensors of a simulated bench
  PluginSettings plugins = {};
  std::function<void(const DeviceLogEntry&)> device_log = {};
  std::function<void(const recipes::AlignState&)> moved_on = {};  ///< called after each step
  const std::atomic<bool>* stop = nullptr;  ///< true: abort and retract the probe
};

struct AlignSummary {
  std::string rig_name;
  BenchKind bench = BenchKind::unknown;  ///< kind of the bench that was aligned
  recipes::AlignPlan plan;
  recipes::AlignDone done;
  /// The first is the tilt before, the last the tilt after.
  std::vector<recipes::TiltFound> rounds;
  double bench_s = 0;                ///< bench clock at the end [s]
  std::int64_t measured_unix_s = 0;  ///< end of the alignment, UTC [s since 1970]
};

/// Brings the bench up and aligns. Leaves the rotary stages where they are and the probe retracted.
/// A failed alignment is a summary with its error. Errors: the reasons why it could not start, and
/// a timeout if the bench stops responding.
Result<AlignSummary> run_alignment(const AlignRequest& request);

}  // namespace weft::daemon
