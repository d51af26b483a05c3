#include "classifier/design/resample.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace weft::classifier::design {
namespace {

/// In (0, 1].
double uniform(RandomEngine& engine) {
  return (static_cast<double>(engine() >> 11) + 1) * 0x1p-53;
}

template <class Statistic>
Interval percentiles(std::span<const double> values, std::size_t draws, std::uint64_t seed,
                     Statistic statistic) {
  RandomEngine engine(seed);
  std::vector<double> found, drawn(values.size());
  for (std::size_t d = 0; d < draws; ++d) {
    const std::vector<std::size_t> of = resampled(values.size(), engine);
    for (std::size_t i = 0; i < of.size(); ++i) drawn[i] = values[of[i]];
    found.push_back(statistic(drawn));
  }
  return {quantile(found, 0.025), quantile(found, 0.975),
          "percentiles of " + std::to_string(draws) + " resamples of the trials"};
}

}  // namespace

std::vector<std::size_t> resampled(std::size_t count, RandomEngine& engine) {
  std::vector<std::size_t> out(count);
  for (std::size_t& item : out) item = random_below(engine, count);
  return out;
}

double normal_draw(RandomEngine& engine) {
  const double radius = std::sqrt(-2 * std::log(uniform(engine)));
  return radius * std::cos(2 * std::numbers::pi * uniform(engine));
}

double quantile(std::vector<double> values, double share) {
  std::ranges::sort(values);
  const double place = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (place - static_cast<double>(below)) * (values[above] - values[below]);
}

Interval mean_interval(std::span<const double> values, std::size_t draws, std::uint64_t seed) {
  return percentiles(values, draws, seed, compute_mean);
}

Interval median_interval(std::span<const double> values, std::size_t draws, std::uint64_t seed) {
  return percentiles(values, draws, seed, [](std::span<const double> drawn) {
    return quantile({drawn.begin(), drawn.end()}, 0.5);
  });
}

}  // namespace weft::classifier::design
