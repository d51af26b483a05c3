#pragma once
// One exploration of one fabric, as the classifier sees it.

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "protocols/base/phase.hpp"

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

}  // namespace weft::classifier
