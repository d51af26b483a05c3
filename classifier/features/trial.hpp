#pragma once
// One exploration of one fabric, as the classifier sees it.

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocols/base/phase.hpp"
#include "protocols/base/result.hpp"

namespace weft::classifier {

/// Samples of all taxels with the phase of each. Phases may be absent except where a user of the
/// trial says otherwise; they need not be contiguous.
struct Trial {
  std::string file;   ///< where it came from; unique in its data set
  std::string label;  ///< fabric
  std::string
      group;  ///< what must not be split between training and test: repetition, fold, swatch
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
/// grid: what is left does not know how hard the pad pressed. Refuses a trial without that phase.
Status without_level(Trial& trial, Phase of);

// Cutting the motion of a trial into windows of equal duration.

struct WindowOptions {
  double window_s = 2.8;
  double step_s = 0.0;           ///< from one start to the next; 0: no overlap
  double sample_period_s = 0.0;  ///< of the recording; must be given
};

/// What the rows of a window are called: "a.csv#w0", "a.csv#w1" ...
std::string window_name(std::string_view recording, std::size_t number);
/// The recording that a file name is of: without what window_name() appends. "press#3" is one.
std::string_view recording_of(std::string_view file);
/// The same; a row without a name is a recording of its own.
std::string recording_of(const std::string& file, std::size_t row);

/// Windows of phase M, in order. No window lies across samples of another phase or across a pause,
/// which the samples of `after_pause` (ascending) follow: each run between them has windows of its
/// own, and what is left over at its end is dropped. Each window inherits label and group, so that
/// a split by group never puts windows of one recording on both sides, and is called window_name().
/// Only phase M is kept: rests and pressure belong to the whole stroke. Refuses durations that are
/// not positive, and a motion of which no run is as long as one window.
Result<std::vector<Trial>> cut_windows(const Trial& trial, const WindowOptions& options,
                                       std::span<const std::size_t> after_pause = {});

}  // namespace weft::classifier
