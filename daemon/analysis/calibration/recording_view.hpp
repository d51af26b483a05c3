#pragma once
// Calibration input from data sets: strokes in counts above the unloaded level. Labels serve only
// as names; no accuracy and no classifier is used.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/storage/dataset/dataset.hpp"

namespace weft::daemon::calibration {

/// One trial's phase M without 0.5 s at both ends (without an eighth if that is less).
struct Stroke {
  std::string cloth;
  std::string conditions;  ///< exploration, factors, direction and speed in the name; without the
                           ///< fabric
  std::string cell;        ///< fabric, conditions, mounting, patch: strokes along one path
  std::uint32_t repetition = 0;  ///< as recorded; otherwise counted within the cell
  std::uint32_t mounting = 0;    ///< from 1 within the fabric; other pieces and files have other
                                 ///< numbers
  std::uint32_t patch = 0;       ///< as recorded; 0: not known
  double speed_mps = 0;          ///< > 0
  double rate_hz = 0;            ///< > 0
  double force_n = std::numeric_limits<double>::quiet_NaN();       ///< mean, > 0; NaN: not recorded
  double rest_force_n = std::numeric_limits<double>::quiet_NaN();  ///< mean of phase S before it
  bool has_rest = false;  ///< phase S was recorded: counts are relative to its mean
  std::vector<std::vector<double>> counts;  ///< [channel][sample] above the unloaded level
  std::vector<double> level;                ///< [channel] mean of counts
  [[nodiscard]] std::size_t samples() const { return counts.empty() ? 0 : counts[0].size(); }
  [[nodiscard]] double pitch_mm() const { return 1e3 * speed_mps / rate_hz; }
};

struct RecordingView {
  std::vector<Stroke> strokes;        ///< in the order of the data sets; not empty
  std::size_t channels = 0;           ///< in every stroke
  std::vector<std::size_t> recorded;  ///< [channels] index on the recorded array, ascending
  std::size_t recorded_channels = 0;  ///< on that array: larger if channels are left out
  std::vector<std::string> remarks;   ///< one sentence each
};

/// Pitches with at most this ratio count as equal.
constexpr double same_pitch = 1.05;
/// Counts above the unloaded level; below this, ratios to the level are noise.
constexpr double least_level = 1;
/// Trials with fewer samples in phase M are refused.
constexpr std::size_t least_samples = 16;

struct ViewOptions {
  std::optional<double> speed_mps;  ///< > 0; if given, the speed of every stroke
};

/// The complete trials of the data sets. Speed: that of the options, else the sweep's factor, else
/// from the recorded stages along x and y, else from a file name in the fabricslide layout.
///
/// Unloaded level: the channel's median in phase S; without S 0, with a remark. (The minimum of a
/// recording that never leaves the fabric is a loaded level: on fabricslide its use makes all
/// modulations four times as large.)
///
/// Left out with a remark: a constant channel, and a channel with more than 1 % of the samples at
/// its limit for 4 samples or longer. Limits: the largest and smallest values, ignoring one sample
/// in a thousand but at least three, so that a glitch hides no limit.
///
/// Errors: invalid_argument (no complete trial; a trial without phase M or with a short one; rate
/// or speed unknown; different numbers of channels); measurement (all channels constant; more than
/// half of them clipped).
Result<RecordingView> make_recording_view(std::span<const Dataset> datasets,
                                          const ViewOptions& options = {});

}  // namespace weft::daemon::calibration
