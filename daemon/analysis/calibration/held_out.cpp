#include "daemon/analysis/calibration/held_out.hpp"

#include <cmath>

#include "daemon/analysis/calibration/stroke_choice.hpp"
#include "sim/plant/random.hpp"

namespace weft::daemon::calibration {
namespace {

constexpr double passing_share = 0.8;
constexpr double least_band_sd = 1e-6;  // for a statistic that does not depend on the seed

/// Two-sided 95 % point of Student's t: Cornish-Fisher to the third order, within 1 % from 4
/// degrees of freedom on.
double student_95(double freedom) {
  constexpr double z = 1.959964;
  const double z3 = z * z * z, z5 = z3 * z * z, n = freedom;
  return z + (z3 + z) / (4 * n) + (5 * z5 + 16 * z3 + 3 * z) / (96 * n * n);
}

/// Sums of one statistic over the replicates.
struct ReplicateTally {
  double sum = 0, squares = 0, count = 0;

  void add(double value) {
    sum += value;
    squares += value * value;
    ++count;
  }
  [[nodiscard]] double mean() const { return sum / count; }
  [[nodiscard]] double sd() const {
    return std::sqrt(std::max(0.0, squares - sum * sum / count) / (count - 1));
  }
};

HeldOutStatistic band_of(const Statistic& real, const ReplicateTally& tally) {
  const double half = student_95(tally.count - 1) * std::max(tally.sd(), least_band_sd) *
                      std::sqrt(1 + 1 / tally.count);
  const double low = tally.mean() - half, high = tally.mean() + half;
  return {real, low, high, real.value >= low && real.value <= high};
}

}  // namespace

bool HeldOutCheck::passes() const {
  return is_checked() &&
         static_cast<double>(inside) >= passing_share * static_cast<double>(statistics.size());
}

Result<HeldOutCheck> check_held_out(const RecordingView& held_out, const ClothModel& model,
                                    std::span<const double> values,
                                    const CalibrationOptions& options) {
  const RecordingView chosen = choose_strokes(held_out, options.windows);
  auto scene = Scene::make(chosen, model);
  if (!scene) return pass(scene.error(), "held out");
  const std::vector<Statistic> real = compute_statistics(chosen).statistics;
  std::vector<ReplicateTally> tallies(real.size());
  for (std::size_t r = 0; r < options.held_out_replicates; ++r) {
    const std::uint64_t seed = sim::mix(sim::mix(options.seed, "held out"), r);
    const auto view = scene->simulate(values, seed, options.threads);
    if (!view) return pass(view.error(), "held out");
    const StatisticSet set = compute_statistics(*view);
    for (std::size_t i = 0; i < real.size(); ++i)
      if (const Statistic* one = find(set.statistics, real[i].name, real[i].cloth))
        tallies[i].add(one->value);
  }
  HeldOutCheck out;
  for (std::size_t i = 0; i < real.size(); ++i) {
    if (tallies[i].count < std::max(2.0, static_cast<double>(options.held_out_replicates) / 2)) {
      out.statistics.push_back({real[i], real[i].value, real[i].value, false});
      continue;
    }
    out.statistics.push_back(band_of(real[i], tallies[i]));
    out.inside += out.statistics.back().is_inside ? 1 : 0;
  }
  return out;
}

}  // namespace weft::daemon::calibration
