#pragma once
// Which strokes of a view are fitted, simulated and held out: by rule, never by chance.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "daemon/analysis/calibration/recording_view.hpp"

namespace weft::daemon::calibration {

/// The strokes at `indices`, in that order; remarks stay.
RecordingView subset(const RecordingView& view, const std::vector<std::size_t>& indices);
/// Those of one cloth; may be none.
RecordingView strokes_of(const RecordingView& view, std::string_view cloth);

/// At most `windows` windows, but one stroke of each cloth in any case. A window is 50 mm or 200
/// samples, whichever there are more of; a shorter stroke counts as one. Cloths take turns; each
/// first takes two repetitions of a cell, then the same of another mounting or place, at conditions
/// that differ from cloth to cloth: a level, a speed and a pair of each as far as there is room.
RecordingView choose_strokes(const RecordingView& view, std::size_t windows);

/// Strokes longer than 200 mm are cut there: four windows and a wave of .01 /mm are in them, and
/// more of them can be simulated. Shorter where the cloths are so many that one such stroke of each
/// would exceed `windows` windows of 200 samples.
RecordingView cut_long_strokes(RecordingView view, std::size_t windows);

/// Of strokes with samples closer than 0.1 mm every k-th sample, k = floor(0.2 mm / pitch), and a
/// remark: no statistic is finer, and the plant's work is by samples. Taken, not averaged: the
/// noise of a sample stays. One k for all strokes of the same conditions and rate, so that
/// repetitions keep one pitch; at least 16 samples are left.
RecordingView thin_dense_strokes(RecordingView view);

/// Without the strokes in which most channels have no level, and a remark that says how many: one
/// of them would take its channels from all statistics.
RecordingView strokes_on_cloth(const RecordingView& view);
/// What to do where recordings have no level: another sign or other units, where that would help.
std::string level_advice(const RecordingView& view);

/// The strokes with the finest pitch, within 5 %: of those the noise law is.
RecordingView finest_strokes(const RecordingView& view);

struct SplitView {
  RecordingView fitted;
  std::optional<RecordingView> held_out;  ///< none: too little is recorded for a check
};
/// Cells with three repetitions or more: their last third, at least one, is held out. Cells with
/// fewer: every third cell of each cloth, so that the pairs of the others can be fitted.
SplitView split_held_out(const RecordingView& view);

}  // namespace weft::daemon::calibration
