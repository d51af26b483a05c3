#include "classifier/design/clustered.hpp"

#include <algorithm>
#include <cmath>

namespace weft::classifier::design {

namespace {

/// Of the share's clusters, as they would be of a single answer: n var(share).
double between_clusters(const ClusteredShare& one) {
  const double share = one.share(), count = static_cast<double>(one.clusters.size());
  double squares = 0;
  for (const ClusteredShare::Cluster& cluster : one.clusters)
    squares += std::pow(cluster.answers * (cluster.share - share), 2);
  return squares * count / (count - 1) / one.requested();
}

}  // namespace

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
    // p (1 - p) of a sample is too small by 1 / n in the mean
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
