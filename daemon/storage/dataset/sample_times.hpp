#pragma once
// The sampling rate, from the times of samples.
//
// Times are regular if each interval, without pauses, is within 1 % of the usual one (plus the step
// of the stamps). One in a hundred intervals may differ: a lost or late sample. No rate is guessed
// from irregular times (batches of an adapter, a coarse clock, frequent losses): the user must
// state it.

#include <cstdint>
#include <vector>

#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// Sampled time, and the number of its intervals.
struct SampledTime {
  double ns = 0;
  double intervals = 0;

  /// Time between samples; 0 if the times do not determine it.
  [[nodiscard]] double period_s() const { return intervals > 0 ? ns / intervals / 1e9 : 0; }
  SampledTime& operator+=(const SampledTime& other);
};

/// The regular intervals of one recording; empty if the times are not regular. A pause is longer
/// than half a second and five usual intervals. The spans between pauses must last half a second on
/// average, unless the rate is 200 Hz or less; otherwise they may be batches of a slow reader.
SampledTime sampled_time(const std::vector<std::int64_t>& t_ns);

/// Indices of samples after a pause, ascending. A pause lasts at least half a second and five usual
/// intervals. With regular times, more than five usual intervals are sufficient, unless the
/// following samples are closer together: an adapter then held them back.
std::vector<std::size_t> samples_after_pause(const std::vector<std::int64_t>& t_ns);

/// Times of trial `i` in phase M, which windows and the spectrum use; of all samples if phase M has
/// fewer than two. Phases before and after may have another rate.
std::vector<std::int64_t> motion_times(const Dataset& dataset, std::size_t i);

/// Largest relative difference of the rates of compared recordings; beyond it features are not
/// comparable.
inline constexpr double rate_tolerance = 0.05;

/// True if the period of the recording can be `period_s` [s]; also if its times do not determine a
/// period.
bool can_have_period(const std::vector<std::int64_t>& t_ns, double period_s);

/// The common period of several recordings, each given by its times [s]: their mean, weighted by
/// the number of intervals. 0 if the times do not determine it.
double common_period_s(const std::vector<std::vector<std::int64_t>>& recordings);

}  // namespace weft::daemon
