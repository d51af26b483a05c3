#pragma once
// Shares whose answers come in clusters: all trials of one replicate are answered by one training,
// so they may be right or wrong together. docs/design.md, "Intervals of a share".

#include <span>
#include <vector>

#include "classifier/base/interval.hpp"

namespace weft::classifier::design {

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

}  // namespace weft::classifier::design
