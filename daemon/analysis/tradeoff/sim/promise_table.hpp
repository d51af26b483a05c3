#pragma once
// Makes the table of the accuracy knob (sim/fidelity.json). It runs one-trial campaigns over the
// recipe space and replays their motion at each setting and in the reference.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "daemon/analysis/tradeoff/sim/recipe_space.hpp"
#include "sim/plant/fidelity/table.hpp"

namespace weft::daemon {

/// The settings in the table. The finest one determines the reference's step.
const std::vector<sim::FidelitySetting>& promise_settings();

struct PromiseTableOptions {
  std::size_t scenes = 800, seeds = 1;
  std::uint64_t space_seed = 1;
  std::string rig_json;      ///< a simulated bench: sim/rigs/bench17.json
  std::string fabrics_json;  ///< sim/fabrics.json
  std::vector<sim::FidelitySetting> settings = promise_settings();
};

/// Errors of one trial of a scene.
struct TrialErrors {
  std::string fabric;
  double scale_n = 0;           ///< sim::impact_scale_n()
  std::vector<double> error_n;  ///< per setting
};

inline constexpr double promised_share = 0.99;  ///< share of the runs

/// For each setting, the smallest margin of 1, 1.1, 1.25, 1.5, 2, 2.5, 3, 4, 6, 8, 12 and 16 that
/// covers promised_share of the runs. If none does, the largest margin, with the share that it
/// covers. The test follows the use of the table: each third of the scenes is held out once. A run
/// of one held-out trial is compared with its fabric's largest error in the other scenes. A run of
/// 34 trials, drawn with `seed`, is compared with the largest error of its fabrics. A fabric that
/// the other scenes lack is skipped. `scene_of[i]`: the scene of trials[i]. Without held-out runs
/// the share is 0.
std::vector<sim::Margin> find_margins(std::size_t settings, std::span<const TrialErrors> trials,
                                      std::span<const std::size_t> scene_of, std::uint64_t seed);
/// The same for fabrics without a row: each fabric is held out once. Its trials are compared with
/// the largest error of all others, in units of the impact scale.
std::vector<sim::Margin> find_any_margins(std::size_t settings,
                                          std::span<const TrialErrors> trials);

/// Errors of every setting, and its margins. Costs are zero.
sim::FidelityTable summarize_errors(const std::vector<sim::FidelitySetting>& settings,
                                    const std::vector<TrialErrors>& trials,
                                    const std::vector<std::size_t>& scene_of,
                                    std::uint64_t space_seed);

/// Checks that all margins hold. Errors: unsupported, for the first setting that fails.
Status check_margins(const sim::FidelityTable& table);

using PromiseProgress = std::function<void(const std::string&)>;

/// `cpu_seconds`: processor time of this process. The caller fills the provenance (made_by, commit,
/// machine, compiler). A table must not be used unless check_margins() accepts it. Errors: those of
/// the rig and the fabric table; unsupported if more than a fifth of the trials fail, or a force is
/// not a number.
Result<sim::FidelityTable> measure_promise_table(const PromiseTableOptions& options,
                                                 const std::function<double()>& cpu_seconds,
                                                 const PromiseProgress& progress = {});

}  // namespace weft::daemon
