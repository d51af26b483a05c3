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
  std::size_t scenes = 800, seeds = 1;
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

/// For each of `settings` the least of 1, 1.1, 1.25, 1.5, 2, 2.5, 3, 4, 6, 8, 12 and 16 that holds
/// for promised_share of the runs as the table is used; where none does, the largest, with the
/// share that it holds for. Each third of the scenes is held back once: runs of one of its trials
/// are held against their own cloth's largest error in the other scenes, and runs of 34 trials,
/// drawn with `seed`, against the largest of their cloths. A cloth that the other scenes lack has
/// no promise to break. `scene_of[i]`: the scene of trials[i]. Nothing to hold back: the share is
/// 0.
std::vector<sim::Margin> find_margins(std::size_t settings, std::span<const TrialErrors> trials,
                                      std::span<const std::size_t> scene_of, std::uint64_t seed);
/// The same for cloths without a row: each cloth is held back once, and its trials are held against
/// the largest error of all others, in units of the impact scale.
std::vector<sim::Margin> find_any_margins(std::size_t settings,
                                          std::span<const TrialErrors> trials);

/// Errors of every setting, and its margins. Costs are left zero.
sim::FidelityTable summarize_errors(const std::vector<sim::FidelitySetting>& settings,
                                    const std::vector<TrialErrors>& trials,
                                    const std::vector<std::size_t>& scene_of,
                                    std::uint64_t space_seed);

/// Whether all margins hold. Errors: unsupported, of the first setting with one that does not.
Status check_margins(const sim::FidelityTable& table);

using PromiseProgress = std::function<void(const std::string&)>;

/// `cpu_seconds`: of this process. Provenance (made_by, commit, machine, compiler) is the caller's.
/// A table whose margins do not hold is none to be used: check_margins().
/// Errors: of rig and cloth table; unsupported, when more than a fifth of the trials fail, or a
/// force is no number.
Result<sim::FidelityTable> measure_promise_table(const PromiseTableOptions& options,
                                                 const std::function<double()>& cpu_seconds,
                                                 const PromiseProgress& progress = {});

}  // namespace weft::daemon
