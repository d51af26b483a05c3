#pragma once
// How far simulated strokes are from recorded ones: Q = sum of ((simulated - recorded)/s)^2 over
// the statistics that some parameter can move, on their own scales. s^2 = s_boot^2 + s_sim^2: how
// sure the recorded statistic is, and how much it depends on the simulation's seed.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "daemon/analysis/calibration/bootstrap.hpp"
#include "daemon/analysis/calibration/scene.hpp"

namespace weft::daemon::calibration {

/// False: derived from others (median, spread between cloths), jumping (peak), read by an estimator
/// (noise, level_spread), or moved by no parameter (jumps, control). They are shown and checked.
bool is_fitted(std::string_view statistic);

struct Target {
  Statistic real;
  double sd = 1;  ///< s, on the statistic's scale
};

/// Targets that both sides have. `replicates`: sets simulated with different seeds.
std::vector<Target> make_targets(const BootstrapSet& real,
                                 std::span<const StatisticSet> replicates);

/// (simulated - recorded)/s of each target; a statistic that the simulation lacks counts as 5.
std::vector<double> residuals(std::span<const Target> targets, const StatisticSet& simulated);
double sum_of_squares(std::span<const double> residuals);

/// The scene as a function of the parameters, with common random numbers: the seed stays.
class Objective {
 public:
  Objective(Scene& scene, std::vector<Target> targets, std::uint64_t seed, std::size_t threads)
      : scene_(&scene), targets_(std::move(targets)), seed_(seed), threads_(threads) {}

  /// `progress` is told the number of evaluations from time to time.
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
