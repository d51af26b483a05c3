#pragma once
// How sure the statistics of a view are: cells drawn again with replacement, then their
// repetitions.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "daemon/analysis/calibration/statistics.hpp"

namespace weft::daemon::calibration {

struct BootstrapStatistic {
  Statistic statistic;        ///< of the view itself
  double standard_error = 0;  ///< on the statistic's scale; 0: fewer than 2 draws had it
  double low = 0, high = 0;   ///< 95 % interval on that scale
  std::size_t draws = 0;      ///< that had it: a draw may lack a cloth's only pair
};

struct BootstrapSet {
  std::vector<BootstrapStatistic> statistics;  ///< in compute_statistics()' order
  std::vector<std::string> remarks;            ///< compute_statistics()'
};

/// Cells are drawn within their cloth, so that each draw has every cloth. Interval: percentiles of
/// the draws, moved so that their median is the statistic: a repetition drawn twice makes spreads
/// between repetitions too small. The same seed gives the same bytes.
BootstrapSet bootstrap_statistics(const RecordingView& view, std::size_t draws, std::uint64_t seed);

}  // namespace weft::daemon::calibration
