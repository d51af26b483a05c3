#pragma once
// What a calibration reads of data sets: strokes in counts above the unloaded level. No label, no
// accuracy and no classifier has a part in it.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon::calibration {

/// One trial's phase M without 0.5 s at both ends (a stroke shorter than 4 s: without an eighth).
struct Stroke {
  std::string cloth;
  std::string cell;               ///< what strokes share that differ in the repetition alone
  std::string conditions;         ///< the cell without cloth and place: equal for other cloths
  std::uint32_t repetition = 0;   ///< within the cell, as recorded; else in order of appearance
  std::uint32_t mounting = 0;     ///< within the cloth; pieces have mountings of their own
  double speed_mps = 0;           ///< > 0
  double rate_hz = 0;             ///< > 0
  double force_n;                 ///< mean of the normal force; NaN: no wrench recorded
  std::vector<std::vector<double>> counts;  ///< [channel][sample] above the unloaded level
  std::vector<double> level;                ///< [channel] mean of counts
  [[nodiscard]] std::size_t samples() const { return counts.empty() ? 0 : counts[0].size(); }
  [[nodiscard]] double pitch_mm() const { return 1e3 * speed_mps / rate_hz; }  ///< of two samples
};

struct RecordingView {
  std::vector<Stroke> strokes;  ///< in the order of the data sets; at least one
  std::size_t channels = 0;     ///< of every stroke
  /// Place of each channel on the array as recorded (0-based), ascending; a gap: left out.
  std::vector<std::size_t> recorded_channel;
  std::size_t recorded_channels = 0;  ///< on the array, with those left out
  std::vector<std::string> remarks;   ///< a sentence each, for the reader of the result
};

struct ViewOptions {
  std::optional<double> speed_mps;  ///< > 0; where given, that of every stroke
};

/// The complete trials of one or several data sets. Speed: that given, else the sweep's factor,
/// else that of the recorded stages, else that in a file name of the fabricslide layout. Unloaded
/// level: the median of phase S; without S the least smoothed value of the channel in all strokes
/// of its array, which a remark says.
/// A channel with more than 1 % of its samples at the end of the range that it reaches (its own
/// extreme value, held) is left out with a remark.
/// Errors: invalid_argument (no complete trial; no phase M; speed unknown; other channel counts in
/// other trials; rate unknown), measurement (all channels constant; more than half of the channels
/// clipped).
Result<RecordingView> make_recording_view(std::span<const Dataset> datasets,
                                          const ViewOptions& options = {});

}  // namespace weft::daemon::calibration
