#pragma once
// Uncertainty of the statistics of a view: draws cells with replacement, then repetitions within
// them.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "daemon/analysis/calibration/statistics.hpp"

namespace weft::daemon::calibration {

struct BootstrapStatistic {
  Statistic statistic;        ///< value for the original view
  double standard_error = 0;  ///< on the statistic's scale; 0: fewer than 2 draws had the statistic
  double low = 0, high = 0;   ///< 95 % interval on that scale
  std::size_t draws = 0;      ///< draws that had the statistic: a draw may lack a fabric's only
                              ///< pair
};

struct BootstrapSet {
  std::vector<BootstrapStatistic> statistics;  ///< in the order of compute_statistics()
  std::vector<std::string> remarks;            ///< those of compute_statistics()
};

/// Cells are drawn within their fabric, so each draw contains every fabric. Interval: percentiles
/// of the draws, shifted so that their median equals the statistic. Without the shift, a repetition
/// drawn twice makes spreads between repetitions too small. The same seed gives the same bytes.
BootstrapSet bootstrap_statistics(const RecordingView& view, std::size_t draws, std::uint64_t seed);

}  // namespace weft::daemon::calibration
