#pragma once
// What a calibration reads of data sets: strokes in counts above the unloaded level. No label, no
// accuracy and no classifier has a part in it.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon::calibration {

/// One trial's phase M without 0.5 s at both ends (without an eighth where that is less).
struct Stroke {
  std::string cloth;
  std::string conditions;  ///< exploration, factors, direction and speed of the name; not the cloth
  std::string cell;        ///< cloth, conditions, mounting, patch: strokes of one path
  std::uint32_t repetition = 0;  ///< as recorded; imported without one: counted within the cell
  std::uint32_t mounting = 0;    ///< from 1 within the cloth; other pieces and files have others
  std::uint32_t patch = 0;       ///< as recorded; 0: not known
  double speed_mps = 0;          ///< > 0
  double rate_hz = 0;            ///< > 0
  double force_n = std::numeric_limits<double>::quiet_NaN();       ///< mean, > 0; NaN: not recorded
  double rest_force_n = std::numeric_limits<double>::quiet_NaN();  ///< mean of phase S before it
  bool has_rest = false;  ///< phase S was recorded: counts are above what was read there
  std::vector<std::vector<double>> counts;  ///< [channel][sample] above the unloaded level
  std::vector<double> level;                ///< [channel] mean of counts
  [[nodiscard]] std::size_t samples() const { return counts.empty() ? 0 : counts[0].size(); }
  [[nodiscard]] double pitch_mm() const { return 1e3 * speed_mps / rate_hz; }
};

struct RecordingView {
  std::vector<Stroke> strokes;        ///< in the order of the data sets; at least one
  std::size_t channels = 0;           ///< of every stroke
  std::vector<std::size_t> recorded;  ///< [channels] place on the recorded array, ascending
  std::size_t recorded_channels = 0;  ///< on that array: more where channels are left out
  std::vector<std::string> remarks;   ///< a sentence each
};

/// Ratio of pitches that count as one.
constexpr double same_pitch = 1.05;
/// Counts above the unloaded level: below, ratios to the level are noise.
constexpr double least_level = 1;
/// Fewer samples of phase M are no stroke.
constexpr std::size_t least_samples = 16;

struct ViewOptions {
  std::optional<double> speed_mps;  ///< > 0; where given, that of every stroke
};

/// The complete trials of the data sets. Speed: that of the options, else the sweep's factor, else
/// that of the recorded stages along x and y, else that in a file name of the fabricslide layout.
/// Unloaded level: the channel's median in phase S; without S 0, which a remark says. (The least
/// value of a recording that never leaves the cloth is a loaded one: on fabricslide taking it for
/// unloaded makes all modulations four times as large.)
/// Left out with a remark: a constant channel; a channel of which more than 1 % of the samples
/// stay at its limit for 4 samples or longer. Limits: the largest and smallest values but for one
/// sample in a thousand, or three, so that a glitch hides none.
/// Errors: invalid_argument (no complete trial; a trial without phase M or with a short one; rate
/// or speed unknown; other numbers of channels); measurement (all channels constant; more than half
/// of them clipped).
Result<RecordingView> make_recording_view(std::span<const Dataset> datasets,
                                          const ViewOptions& options = {});

}  // namespace weft::daemon::calibration
