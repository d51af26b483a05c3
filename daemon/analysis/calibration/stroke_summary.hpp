#pragma once
// Summaries of strokes and of pairs of strokes, needed by the statistics and computed once: a
// bootstrap combines them hundreds of times.

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "daemon/analysis/calibration/signal.hpp"
#include "daemon/analysis/calibration/statistics.hpp"

namespace weft::daemon::calibration {

constexpr double window_mm = 50;
constexpr std::size_t least_window_samples = 8;

/// A section of 50 mm, or all of a shorter stroke.
struct WindowSummary {
  double modulation = 0;           ///< median over channels of sd(zd)
  double neighbours = 0, far = 0;  ///< mean correlation of the pairs; 0: no pairs
  double common_share = 0;
  std::vector<double> log_pattern;  ///< [channel]; empty if a mean is not positive
};

struct StrokeSummary {
  std::vector<WindowSummary> windows;
  double modulation = 0;  ///< median over channels of sd(z)
  std::array<std::optional<double>, bands> band;
  std::vector<double> level, noise;  ///< [channel] counts
  std::optional<double> level_spread;
  double drift = 0, jumps = 0;
};

/// Two strokes of one cell with first < second, or first and a stroke of another fabric.
struct PairSummary {
  std::size_t first = 0, second = 0;
  double correlation = 0, lag_mm = 0;
};

/// Strokes of one cell, in the view's order.
struct Cell {
  std::size_t cloth = 0;  ///< index in Summaries::cloths
  std::vector<std::size_t> strokes;
};

struct Summaries {
  const RecordingView* view = nullptr;
  double finest_mm = 0;               ///< smallest pitch of the strokes
  std::vector<std::size_t> channels;  ///< channels of the view with a level in every stroke
  bool square = false;                ///< the array has equal numbers of rows and columns
  std::vector<StrokeSummary> strokes;
  std::vector<std::string> cloths;                    ///< sorted
  std::vector<Cell> cells;                            ///< sorted by fabric, then by name
  std::vector<std::vector<PairSummary>> repetitions;  ///< [cell]
  std::vector<PairSummary> controls;                  ///< sorted by first
  std::vector<std::string> remarks;
};

/// `view` must outlive the result.
Summaries summarise(const RecordingView& view);

/// A drawn cell: its index, and strokes of it, possibly repeated.
struct DrawnCell {
  std::size_t cell = 0;
  std::vector<std::size_t> strokes;
};
std::vector<DrawnCell> all_cells(const Summaries& summaries);
StatisticSet combine(const Summaries& summaries, const std::vector<DrawnCell>& sample);

}  // namespace weft::daemon::calibration
