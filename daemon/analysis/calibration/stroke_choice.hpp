#pragma once
// Selects the strokes of a view that are fitted, simulated and held out: by rule, never at random.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/analysis/calibration/recording_view.hpp"

namespace weft::daemon::calibration {

/// The strokes at `indices`, in that order; remarks are kept.
RecordingView subset(const RecordingView& view, const std::vector<std::size_t>& indices);
/// The strokes of one fabric; may be empty.
RecordingView strokes_of(const RecordingView& view, std::string_view cloth);

/// At most `windows` windows, but at least one stroke of each fabric. A window is 50 mm or 200
/// samples, whichever gives more windows; a shorter stroke counts as one. Fabrics are served in
/// turn. Each first gets two repetitions of a cell, then the same of another mounting or place,
/// under conditions that differ between fabrics. So each fabric gets a level, a speed and a pair,
/// as far as space permits.
RecordingView choose_strokes(const RecordingView& view, std::size_t windows);

/// Cuts strokes longer than 200 mm: this length contains four windows and a wave of .01 /mm, and
/// more such strokes can be simulated. The limit is lower with many fabrics, so that one stroke of
/// each does not exceed `windows` windows of 200 samples.
RecordingView cut_long_strokes(RecordingView view, std::size_t windows);

/// For strokes with samples closer than 0.1 mm, keeps every k-th sample, k = floor(0.2 mm / pitch),
/// with a remark. No statistic is finer, and the plant's work grows with the samples. Samples are
/// not averaged, which keeps the noise of a sample. All strokes of the same conditions and rate
/// have one k, so that repetitions keep one pitch; at least 16 samples remain.
RecordingView thin_dense_strokes(RecordingView view);

/// Without the strokes in which most channels have no level; a remark gives their number. One such
/// stroke would exclude its channels from all statistics.
RecordingView strokes_on_cloth(const RecordingView& view);
/// Advice for recordings without a level: another sign or other units, if that would help.
std::string level_advice(const RecordingView& view);

/// The strokes with the finest pitch, within 5 %; they determine the noise law.
RecordingView finest_strokes(const RecordingView& view);

struct SplitView {
  RecordingView fitted;
  std::optional<RecordingView> held_out;  ///< none: too few recordings for a check
};
/// For cells with at least three repetitions, holds out their last third, but at least one
/// repetition. For cells with fewer, holds out every third cell of each fabric, so that pairs in
/// the other cells can be fitted.
SplitView split_held_out(const RecordingView& view);

}  // namespace weft::daemon::calibration
