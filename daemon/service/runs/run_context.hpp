#pragma once
// What the parts of daemon/service/runs are given from outside.

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>

#include "daemon/campaign/bench_check.hpp"
#include "daemon/campaign/campaign.hpp"
#include "daemon/service/runs/run_observer.hpp"

namespace weft::daemon::runs {

struct RunContext {
  std::filesystem::path rig;                        ///< rig file
  std::filesystem::path data;                       ///< one folder for each run
  std::function<void(std::function<void()>)> post;  ///< onto the server's thread, from any
  std::function<std::chrono::nanoseconds()> now;    ///< monotonic
  std::function<std::int64_t()> utc_us;
  RunObserver* observer = nullptr;            ///< outlives the manager
  LiveFrameSampler* frame_sampler = nullptr;  ///< shown what the run under way senses
  const BenchPace* pace = nullptr;            ///< of a simulated bench
  /// The machine's wall clock, which people compare times ahead with; it may be set back.
  std::function<std::int64_t()> wall_us = {};
  /// What a run is, on its thread.
  std::function<Result<CampaignSummary>(const CampaignRequest&, const CampaignHooks&)> perform =
      run_campaign;
  /// Whether a folder has space for a number of bytes.
  std::function<Status(const std::filesystem::path&, std::uint64_t)> check_space =
      daemon::check_space;
  /// Whether a rig file can be run, as far as that is known without a recipe.
  std::function<Status(const std::filesystem::path&)> check_rig_file = daemon::check_rig_file;
  /// Of the daemon inside `weft run`: after the first submit() every other is refused, the run has
  /// no deadline but those that follow an order, and ends for good.
  bool one_run = false;
};

}  // namespace weft::daemon::runs
