#pragma once
// One exploration of one fabric as input of the classifier.

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/phase.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Samples of all taxels with the phase of each. Phases may be absent unless a function of the
/// trial requires them; they need not be contiguous.
struct Trial {
  std::string file;   ///< source; unique in its data set
  std::string label;  ///< fabric
  std::string group;  ///< unit that a split must not divide: repetition, fold, piece
  std::size_t taxels = 0;
  std::vector<double> counts;  ///< [samples x taxels], row-major, raw counts
  std::vector<Phase> phase;    ///< [samples]

  [[nodiscard]] std::size_t samples() const { return phase.size(); }
  [[nodiscard]] std::size_t motion_samples() const {
    return static_cast<std::size_t>(std::ranges::count(phase, Phase::motion));
  }
  [[nodiscard]] std::span<const double> row(std::size_t i) const {
    return {counts.data() + i * taxels, taxels};
  }
};

/// Subtracts from every taxel its mean of phase `of`, rounded to counts so that the mode keeps its
/// grid. The rest does not depend on the pressure. Errors: not_found without a sample of that
/// phase.
Status without_level(Trial& trial, Phase of);

// Cutting the motion of a trial into windows of equal duration.

struct WindowOptions {
  double window_s = 2.8;
  double step_s = 0.0;           ///< time between two starts; 0: no overlap
  double sample_period_s = 0.0;  ///< of the recording; required
};

/// Name of the rows of a window: "a.csv#w0", "a.csv#w1" ...
std::string window_name(std::string_view recording, std::size_t number);
/// The recording of a file name: the name without the suffix of window_name(). "press#3" is one.
std::string_view recording_of(std::string_view file);
/// The same; a row without a name is its own recording.
std::string recording_of(const std::string& file, std::size_t row);

/// Windows of phase M, in order. No window spans samples of another phase or a pause; `after_pause`
/// (ascending) lists the samples after a pause. Each run between them has its own windows, and the
/// remainder at its end is dropped. Each window inherits label and group, so a split by group never
/// puts windows of one recording on both sides. It is named by window_name(). Only phase M is kept:
/// rests and pressure belong to the whole stroke. Refuses durations that are not positive, and a
/// motion without a run as long as one window.
Result<std::vector<Trial>> cut_windows(const Trial& trial, const WindowOptions& options,
                                       std::span<const std::size_t> after_pause = {});

}  // namespace weft::classifier
