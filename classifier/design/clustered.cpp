#include "classifier/design/clustered.hpp"

#include <algorithm>
#include <cmath>

namespace weft::classifier::design {

double ClusteredShare::share() const {
  return mean_of(of_cluster);
}

double ClusteredShare::asked() const {
  return each * static_cast<double>(of_cluster.size());
}

double design_effect(std::span<const ClusteredShare> shares) {
  double between = 0, independent = 0, most = 1;
  for (const ClusteredShare& one : shares) {
    const double asked = one.asked();
    if (one.of_cluster.size() < 2 || asked <= 1) continue;
    between += one.each * std::pow(deviation_of(one.of_cluster), 2);
    // p (1 - p) of a sample is too small by 1 / n in the mean
    independent += one.share() * (1 - one.share()) * asked / (asked - 1);
    most = std::max(most, one.each);
  }
  return independent > 0 ? std::clamp(between / independent, 1.0, most) : 1.0;
}

Interval clustered_interval(const ClusteredShare& share, double effect) {
  Interval out = wilson_of_share(share.share(), share.asked() / effect);
  out.method = "Wilson score of the effective number of answers";
  return out;
}

}  // namespace weft::classifier::design
