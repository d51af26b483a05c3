#pragma once
// Resampling with replacement (Efron 1979), the same with every compiler.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "classifier/base/interval.hpp"
#include "classifier/base/random.hpp"

namespace weft::classifier::design {

// Shares whose answers come in clusters: all trials of one replicate are answered by one training,
// so they may be right or wrong together. docs/design.md, "Intervals of a share".

/// A share of right answers, by cluster.
struct ClusteredShare {
  struct Cluster {
    double share = 0;    ///< 0 to 1
    double answers = 1;  ///< at least 1
  };
  std::vector<Cluster> clusters;       ///< at least one
  [[nodiscard]] double share() const;  ///< of all answers, so that a larger cluster weighs more
  [[nodiscard]] double requested() const;
};

/// By how much the answers of a cluster hang together: the variance between clusters over what it
/// would be if all answers were independent (Kish 1965, Survey Sampling, sections 5.4 and 6.4: a
/// ratio mean, so that clusters need not be of one size), as a ratio of sums over all `shares`,
/// because a few clusters alone tell too little of it. At least 1, at most the answers of a
/// cluster; 1 where no share has an error or none has two clusters.
double design_effect(std::span<const ClusteredShare> shares);

/// Wilson's interval of the effective number of answers, asked / design effect (Dean and Pagano
/// 2015, Journal of Survey Statistics and Methodology 3). It has width at 0 and 1 too.
Interval clustered_interval(const ClusteredShare& share, double effect);

/// `count` numbers below `count`, with replacement; count > 0.
std::vector<std::size_t> resampled(std::size_t count, RandomEngine& engine);

/// Standard normal (Box and Muller 1958).
double normal_draw(RandomEngine& engine);

/// Value below which `share` (0 to 1) of `values` lies, between neighbours in proportion. At least
/// one value; they are sorted.
double quantile(std::vector<double> values, double share);

/// The middle 95 % of the means of `draws` resamples; a single value has no interval but itself.
Interval mean_interval(std::span<const double> values, std::size_t draws, std::uint64_t seed);

/// The same of their median.
Interval median_interval(std::span<const double> values, std::size_t draws, std::uint64_t seed);

}  // namespace weft::classifier::design
