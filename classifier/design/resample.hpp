#pragma once
// Resampling with replacement (Efron 1979), equal with every compiler.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "classifier/base/interval.hpp"
#include "classifier/base/random.hpp"

namespace weft::classifier::design {

// Shares of answers in clusters. One training predicts all trials of one replicate, so they may be
// right or wrong together. docs/explanation/statistics.md, "Intervals".

/// A share of right answers, by cluster.
struct ClusteredShare {
  struct Cluster {
    double share = 0;    ///< 0 to 1
    double answers = 1;  ///< at least 1
  };
  std::vector<Cluster> clusters;       ///< at least one
  [[nodiscard]] double share() const;  ///< share of all answers: a larger cluster weighs more
  [[nodiscard]] double requested() const;
};

/// How strongly the answers of a cluster correlate: the variance between clusters over the variance
/// of independent answers. It is a ratio mean, so clusters may differ in size (Kish 1965, Survey
/// Sampling, sections 5.4 and 6.4). It is a ratio of sums over all `shares`, because a few clusters
/// alone give a poor estimate. At least 1, at most the answers of a cluster; 1 where no share has
/// an error or none has two clusters.
double design_effect(std::span<const ClusteredShare> shares);

/// Wilson's interval of the effective number of answers: answers / design effect (Dean and Pagano
/// 2015, Journal of Survey Statistics and Methodology 3). Its width is above 0 even at 0 and 1.
Interval clustered_interval(const ClusteredShare& share, double effect);

/// `count` numbers below `count`, with replacement; count > 0.
std::vector<std::size_t> resampled(std::size_t count, RandomEngine& engine);

/// Standard normal (Box and Muller 1958).
double normal_draw(RandomEngine& engine);

/// Quantile `share` (0 to 1) of `values`, linear between neighbours. Sorts the values; needs at
/// least one.
double quantile(std::vector<double> values, double share);

/// The middle 95 % of the means of `draws` resamples. The interval of a single value is that value.
Interval mean_interval(std::span<const double> values, std::size_t draws, std::uint64_t seed);

/// The middle 95 % of the medians of `draws` resamples.
Interval median_interval(std::span<const double> values, std::size_t draws, std::uint64_t seed);

}  // namespace weft::classifier::design
