#pragma once
// What the times of samples tell of their rate.
//
// The model: a sensor's clock is even, and a sample is stamped late or on time: by the step of a
// coarse clock, the wait for a batch, a reader's stall. Lateness does not add up, so that stamps
// return to the straight line of the samples' numbers, and its slope is the period. Where they
// leave it for good, samples are missing, a whole number each time. What is longer than any
// adapter holds samples back is a pause: after it a line begins anew. Not where what lies between
// was read at once: such batches lie on one line, however long their wait.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon {

/// Time that was sampled, and in how many intervals, those of lost frames among them.
struct SampledTime {
  double ns = 0;
  double intervals = 0;

  /// From sample to sample; 0 where the times do not tell.
  [[nodiscard]] double period_s() const { return intervals > 0 ? ns / intervals / 1e9 : 0; }
  SampledTime& operator+=(const SampledTime& other);
};

/// Of one recording, without its pauses, to the step of its stamps over its duration. Frames that
/// were lost evenly (one in six, always) in stamps of whole periods cannot be told from a coarse
/// clock, and are taken for one; of what is left of fewer than half the frames, or of more than a
/// tenth lost where stamps scatter by a quarter of the period, the rate may be off. Nothing where
/// there are pauses, and what lies between lasts less than half a second and is of more than
/// 200 Hz: it may be strokes, or batches of a slower sensor. Of more than 2 kHz it is batches if
/// these are as large as their waits are long.
SampledTime sampled_time(const std::vector<std::int64_t>& t_ns);

/// By how many periods stamps leave the straight line, single late ones left aside, beyond what
/// their scatter explains: 0.5 or more where a sample or more is missing, but in the last two or
/// three stamps or where they scatter by half a period; infinite at a pause, or where the times
/// tell no period. A coarse clock whose step is the period to less than 2 % looks as if a sample
/// were missing each time it jumps.
double missing_samples(const std::vector<std::int64_t>& t_ns);

/// Times of trial `i` in phase M, which windows and the spectrum are of; of all its samples where
/// it has fewer than two there. Phases before and after may be recorded at another rate.
std::vector<std::int64_t> motion_times(const Dataset& dataset, std::size_t i);

/// By how much the rate of one recording may differ from that of others that it is compared with:
/// beyond it features mean something else.
inline constexpr double rate_tolerance = 0.05;

/// Whether a recording may be of this period [s]. True where its times tell nothing, or may be of
/// one batch.
bool can_have_period(const std::vector<std::int64_t>& t_ns, double period_s);

/// The period that recordings have in common [s], each given by its times: their mean, each of the
/// weight of its intervals. 0 where the times tell nothing.
double common_period_s(const std::vector<std::vector<std::int64_t>>& recordings);

}  // namespace weft::daemon
