#pragma once
// Makes the table of the knob (sim/fidelity.json): one-trial campaigns over the recipe space, whose
// motion is replayed at each setting and against the reference.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "daemon/analysis/tradeoff/sim/recipe_space.hpp"
#include "sim/plant/fidelity/table.hpp"

namespace weft::daemon {

/// The settings that the table offers. The finest decides the reference's step.
const std::vector<sim::FidelitySetting>& promise_settings();

struct PromiseTableOptions {
  std::size_t scenes = 600, seeds = 5;
  std::uint64_t space_seed = 1;
  std::string rig_json;      ///< of a simulated bench: sim/rigs/bench17.json
  std::string fabrics_json;  ///< sim/fabrics.json
  std::vector<sim::FidelitySetting> settings = promise_settings();
};

/// What one trial of a scene showed.
struct TrialErrors {
  std::string fabric;
  double scale_n = 0;           ///< sim::impact_scale_n()
  std::vector<double> error_n;  ///< of each setting
};

inline constexpr double promised_share = 0.99;  ///< of runs

/// The least of 1, 1.1, 1.25, 1.5 and 2 such that, of runs of 34 trials that are drawn from
/// `held_back`, the share promised_share stays below the margin times the largest error of their
/// cloths in `measured`, at every setting. 2 where none does; 1 without trials held back. Runs
/// hold trials of cloths that are in `measured` alone.
double find_margin(std::span<const TrialErrors> measured, std::span<const TrialErrors> held_back,
                   std::uint64_t seed);

/// Errors of every setting, margin included: a third of the scenes, every third one, is held back
/// for the margin and then counts like the others. `scene_of[i]`: the scene of trials[i]. Costs
/// are left zero.
sim::FidelityTable summarize_errors(const std::vector<sim::FidelitySetting>& settings,
                                    const std::vector<TrialErrors>& trials,
                                    const std::vector<std::size_t>& scene_of,
                                    std::uint64_t space_seed);

using PromiseProgress = std::function<void(const std::string&)>;

/// `cpu_seconds`: of this process. Provenance (made_by, commit, machine, compiler) is the caller's.
/// Errors: of rig and cloth table; unsupported, when more than a fifth of the trials fail.
Result<sim::FidelityTable> measure_promise_table(const PromiseTableOptions& options,
                                                 const std::function<double()>& cpu_seconds,
                                                 const PromiseProgress& progress = {});

}  // namespace weft::daemon
