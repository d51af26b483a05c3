#pragma once
// Distance of simulated strokes from recorded ones: Q = sum of ((simulated - recorded)/s)^2 over
// the statistics that some parameter can change, each on its scale. s^2 = s_boot^2 + s_sim^2:
// uncertainty of the recorded statistic, and its dependence on the simulation's seed.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "daemon/analysis/calibration/bootstrap.hpp"
#include "daemon/analysis/calibration/scene.hpp"

namespace weft::daemon::calibration {

/// False for statistics that are derived from others (median, spread between fabrics), jump (peak),
/// are used by an estimator (noise, level_spread), or depend on no parameter (jumps, control).
/// These are shown and checked.
bool is_fitted(std::string_view statistic);

struct Target {
  Statistic real;
  double sd = 1;  ///< s, on the statistic's scale
};

/// Targets that both sides have. `replicates`: sets simulated with different seeds.
std::vector<Target> make_targets(const BootstrapSet& real,
                                 std::span<const StatisticSet> replicates);

/// (simulated - recorded)/s of each target; a statistic missing from the simulation counts as 5.
std::vector<double> residuals(std::span<const Target> targets, const StatisticSet& simulated);
double sum_of_squares(std::span<const double> residuals);

/// The scene as a function of the parameters, with common random numbers: the seed is constant.
class Objective {
 public:
  Objective(Scene& scene, std::vector<Target> targets, std::uint64_t seed, std::size_t threads)
      : scene_(&scene), targets_(std::move(targets)), seed_(seed), threads_(threads) {}

  /// `progress` receives the number of evaluations from time to time.
  void report_to(std::function<void(std::size_t evaluations)> progress) {
    progress_ = std::move(progress);
  }
  /// Errors: the scene's.
  Result<std::vector<double>> residuals_at(std::span<const double> values);
  Result<double> cost_at(std::span<const double> values);
  [[nodiscard]] const std::vector<Target>& targets() const { return targets_; }
  [[nodiscard]] std::size_t evaluations() const { return evaluations_; }

 private:
  Scene* scene_;
  std::vector<Target> targets_;
  std::uint64_t seed_;
  std::size_t threads_, evaluations_ = 0;
  std::function<void(std::size_t)> progress_;
};

}  // namespace weft::daemon::calibration
