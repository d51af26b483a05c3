#include "classifier/design/resample.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace weft::classifier::design {
namespace {

/// Uniform in (0, 1].
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

/// Variance of the share between clusters, scaled to a single answer: n var(share).
double between_clusters(const ClusteredShare& one) {
  const double share = one.share(), count = static_cast<double>(one.clusters.size());
  double squares = 0;
  for (const ClusteredShare::Cluster& cluster : one.clusters)
    squares += std::pow(cluster.answers * (cluster.share - share), 2);
  return squares * count / (count - 1) / one.requested();
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

double ClusteredShare::share() const {
  double right = 0;
  for (const Cluster& cluster : clusters) right += cluster.share * cluster.answers;
  return right / requested();
}

double ClusteredShare::requested() const {
  double sum = 0;
  for (const Cluster& cluster : clusters) sum += cluster.answers;
  return sum;
}

double design_effect(std::span<const ClusteredShare> shares) {
  double between = 0, independent = 0, most = 1;
  for (const ClusteredShare& one : shares) {
    const double requested = one.requested();
    if (one.clusters.size() < 2 || requested <= 1) continue;
    between += between_clusters(one);
    // The p (1 - p) of a sample of n is on average too small by a factor of 1 - 1 / n.
    independent += one.share() * (1 - one.share()) * requested / (requested - 1);
    for (const ClusteredShare::Cluster& cluster : one.clusters)
      most = std::max(most, cluster.answers);
  }
  return independent > 0 ? std::clamp(between / independent, 1.0, most) : 1.0;
}

Interval clustered_interval(const ClusteredShare& share, double effect) {
  Interval out = wilson_of_share(share.share(), share.requested() / effect);
  out.method = "Wilson score of the effective number of answers";
  return out;
}

}  // namespace weft::classifier::design
