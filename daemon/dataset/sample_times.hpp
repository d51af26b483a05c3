#pragma once
// What the times of samples tell of their rate.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "daemon/dataset/dataset.hpp"

namespace weft::daemon {

/// Time that was sampled, and in how many intervals.
struct SampledTime {
  double seconds = 0;
  double intervals = 0;

  /// From sample to sample; 0 where the times do not tell.
  [[nodiscard]] double period_s() const { return intervals > 0 ? seconds / intervals : 0; }
  SampledTime& operator+=(const SampledTime& other);
};

/// Of one recording, without its pauses: between phases nothing is recorded, and frames get lost. A
/// pause is longer than one and a half times what three quarters of the intervals keep within, so
/// that stamps in whole milliseconds make none. Of samples that were read in batches, with little
/// or nothing between them, whole batches are compared: the gap before one is when it was sampled.
SampledTime sampled_time(const std::vector<std::int64_t>& t_ns);

/// Times of trial `i` in phase M, which windows and the spectrum are of; of all its samples where
/// it has fewer than two there. Phases before and after may be recorded at another rate.
std::vector<std::int64_t> motion_times(const Dataset& dataset, std::size_t i);

/// By how much the rate of one recording may differ from that of others that it is compared with:
/// beyond it features mean something else.
inline constexpr double rate_tolerance = 0.05;

/// Whether a recording may be of this period [s]: by its mean, or by the interval in the middle,
/// which a reader that stalled and caught up does not move; of samples read in batches it says
/// nothing. True where its times tell nothing.
bool may_have_period(const std::vector<std::int64_t>& t_ns, double period_s);

/// The period that recordings have in common [s], each given by its times: that of their mean where
/// each may have it. Where not, the median of the intervals in the middle of each, which frames
/// that some of them lost do not move, if it suits each; else the mean. 0 where the times tell
/// nothing.
double common_period_s(const std::vector<std::vector<std::int64_t>>& recordings);

}  // namespace weft::daemon
