#pragma once
// The sampling rate that the times of samples tell.
//
// Times are regular where each interval, pauses left out, is within 1 % of the usual one (and the
// step of the stamps), but for one in a hundred: a lost or a late sample. A rate is never guessed
// from others (batches of an adapter, a coarse clock, frames lost often): it is to be stated.

#include <cstdint>
#include <vector>

#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// Time that was sampled, and in how many intervals.
struct SampledTime {
  double ns = 0;
  double intervals = 0;

  /// From sample to sample; 0 where the times do not tell.
  [[nodiscard]] double period_s() const { return intervals > 0 ? ns / intervals / 1e9 : 0; }
  SampledTime& operator+=(const SampledTime& other);
};

/// Of one recording, its regular intervals alone; nothing where the times are not regular. A pause
/// is longer than half a second and five usual intervals. What lies between pauses must last half a
/// second on average, or be of 200 Hz or less: else it may be batches of a slow reader.
SampledTime sampled_time(const std::vector<std::int64_t>& t_ns);

/// Samples that follow a pause, ascending: where at least half a second and five usual intervals
/// went by; of regular times also where more than five usual intervals did, unless the samples
/// after it come closer together, as those that an adapter held back do.
std::vector<std::size_t> samples_after_pause(const std::vector<std::int64_t>& t_ns);

/// Times of trial `i` in phase M, which windows and the spectrum are of; of all its samples where
/// it has fewer than two there. Phases before and after may be recorded at another rate.
std::vector<std::int64_t> motion_times(const Dataset& dataset, std::size_t i);

/// By how much the rate of one recording may differ from that of others that it is compared with:
/// beyond it features mean something else.
inline constexpr double rate_tolerance = 0.05;

/// Whether a recording may be of this period [s]. True where its times tell nothing.
bool can_have_period(const std::vector<std::int64_t>& t_ns, double period_s);

/// The period that recordings have in common [s], each given by its times: their mean, each of the
/// weight of its intervals. 0 where the times tell nothing.
double common_period_s(const std::vector<std::vector<std::int64_t>>& recordings);

}  // namespace weft::daemon
