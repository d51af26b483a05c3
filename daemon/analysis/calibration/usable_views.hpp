#pragma once
// Selects the part of the recordings that a calibration can use.

#include <cstddef>
#include <optional>

#include "daemon/analysis/calibration/recording_view.hpp"

namespace weft::daemon::calibration {

struct UsableViews {
  RecordingView fitted;
  std::optional<RecordingView> held_out;  ///< without strokes if none was on a fitted fabric
};
/// Strokes are thinned, cut, and on the fabric (stroke_choice.hpp). Held-out fabrics without a
/// fitted stroke on the fabric are left out with a remark. Errors: those of calibrate() about
/// views.
Result<UsableViews> usable_views(const RecordingView& fitted,
                                 const std::optional<RecordingView>& held_out, std::size_t windows);

}  // namespace weft::daemon::calibration
