#pragma once
// What of the recordings a calibration can use.

#include <cstddef>
#include <optional>

#include "daemon/analysis/calibration/recording_view.hpp"

namespace weft::daemon::calibration {

struct UsableViews {
  RecordingView fitted;
  std::optional<RecordingView> held_out;  ///< without strokes where none was on a fitted cloth
};
/// Thinned, cut, on the cloth (stroke_choice.hpp). Held-out cloths whose fitted strokes are all off
/// the cloth are left out with a remark. Errors: those of calibrate() that are about views.
Result<UsableViews> usable_views(const RecordingView& fitted,
                                 const std::optional<RecordingView>& held_out, std::size_t windows);

}  // namespace weft::daemon::calibration
